// A delay of a whole or fractional number of periods, as a ring buffer that is allocated once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "upright/control/state.hpp"

namespace upright {

/// Stores one state per period and returns the state `delay_s` ago: exactly when the delay is a multiple
/// of the period, otherwise by linear interpolation between the two neighbouring samples (`exact` tells
/// which). Before the first sample, the first state is held: the constant history of equation (15) of the
/// paper.
class DelayLine {
 public:
  /// A delay within 1e-9 periods of a whole number counts as that number (0.003 s at 1 kHz is 3 samples,
  /// although neither is a binary fraction). Throws ConfigError when the delay or the period is invalid.
  DelayLine(double delay_s, double period_s);

  double delay_s() const { return delay_s_; }      ///< the delay [s]
  bool exact() const { return fraction_ == 0.0; }  ///< whether the delay is a whole number of periods
  /// The whole periods of the delay, and the remainder as a fraction of a period.
  std::size_t whole_periods() const { return whole_; }
  /// The part of a period beyond `whole_periods`, from 0 up to 1.
  double fraction() const { return fraction_; }

  /// Discards the history and fills it with `state`.
  void start(const ControlState& state) noexcept;
  /// Appends the state of the next period.
  void push(const ControlState& state) noexcept;
  /// The state `delay_s` before the one appended last.
  ControlState delayed() const noexcept;

  static constexpr double longest_delay_s = 10.0;       ///< the longest delay [s]
  static constexpr double longest_delay_periods = 1e6;  ///< the longest delay [periods]

 private:
  const ControlState& back(std::size_t periods) const noexcept;

  double delay_s_;
  std::size_t whole_ = 0;
  double fraction_ = 0.0;
  std::vector<ControlState> ring_;
  std::size_t newest_ = 0;
};

}  // namespace upright
