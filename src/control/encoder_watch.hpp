// Detects an encoder that has stopped counting while the loop balances: its counts are fresh but no
// longer correct. Causes are a disconnected cable, a disabled amplifier or a blocked cart. One call per
// computed period; deterministic, bounded work, no allocation.
//
// Cart: since its last count, models of a resting cart are driven by the applied voltages, one for each
// corner of the assumed ranges of friction and lag. The encoder is stuck when all of them have travelled
// several counts, twice. A cart that dry friction holds at rest is therefore not reported.
//
// Pendulum: while the angle is constant, the cart's acceleration is g tan(theta), a constant, up to the
// friction in the pivot and the resolution of a count. The encoder is stuck when the cart's path deviates
// from every parabola by more than that.
#pragma once

#include <array>
#include <cstdint>

#include "upright/control/encoder_assumptions.hpp"

namespace upright {

/// One period with fresh counts, in which the loop balances.
struct WatchedPeriod {
  std::uint64_t tick = 0;            ///< number of the period
  double time_s = 0.0;               ///< time of the reading [s]
  std::int64_t cart_counts = 0;      ///< as the device gave them
  std::int64_t pendulum_counts = 0;  ///< as the device gave them
  double cart_m = 0.0;               ///< scaled and unwrapped
  double voltage_v = 0.0;            ///< applied from this period on
};

/// A resting cart driven by the applied voltages, with one value of friction and one of lag. The force of
/// the upright pendulum on the cart is neglected: it is far below the uncertainty of the friction.
class DrivenCart {
 public:
  DrivenCart() = default;
  /// `breakaway_v` moves a resting cart [V]; `lag_s` is that of the motor [s].
  DrivenCart(const EncoderAssumptions& assumptions, double breakaway_v, double lag_s);

  /// Stops the cart; the motor's force continues.
  void rest() noexcept { velocity_mps_ = travel_m_ = 0.0; }
  /// Advances under `voltage_v`; returns the distance from the place of rest [m].
  double step(double voltage_v, double duration_s) noexcept;

 private:
  double acceleration_mps2_per_v_ = 0.0, damping_v_per_mps_ = 0.0, breakaway_v_ = 0.0, lag_s_ = 0.0;
  double acting_v_ = 0.0, velocity_mps_ = 0.0, travel_m_ = 0.0;
};

/// The latest cart positions as means over short intervals, and their distance from a parabola.
class CartPath {
 public:
  void clear() noexcept { count_ = filling_ = 0; }  ///< forgets everything
  /// True when an interval was completed.
  bool add(double time_s, double cart_m) noexcept;
  /// Root mean square residual of the best parabola [m]; 0 with fewer than `min_points` intervals.
  double rms_from_parabola_m() const noexcept;
  double duration_s() const noexcept;  ///< from the first to the last kept interval [s]

 private:
  static constexpr std::size_t max_points = 32, min_points = 8;
  static constexpr double interval_s = 0.01;
  struct Point {
    double time_s = 0.0, cart_m = 0.0;
  };
  std::array<Point, max_points> points_{};
  std::size_t count_ = 0, next_ = 0;
  Point sum_;
  double first_s_ = 0.0;
  int filling_ = 0;
};

/// Finds encoders whose fresh counts do not follow the motion.
class EncoderWatch {
 public:
  /// `m_per_count`, `rad_per_count`: resolution of the encoders.
  EncoderWatch(const EncoderAssumptions& assumptions, double m_per_count, double rad_per_count) noexcept;

  /// Takes one period; says which encoder is stuck, if any.
  StuckEncoder step(const WatchedPeriod& period) noexcept;
  /// Discards the history: for periods in which the loop does not balance.
  void reset() noexcept { started_ = false; }
  /// The first period in which that encoder did not count.
  std::uint64_t silent_since(StuckEncoder encoder) const noexcept {
    return (encoder == StuckEncoder::cart ? cart_ : pendulum_).since_tick + 1;
  }

 private:
  /// The time since which an encoder has not counted.
  struct Silence {
    std::int64_t counts = 0;
    std::uint64_t since_tick = 0;
    double since_s = 0.0;
  };
  /// One of the cart models, and how often it has moved away without a count.
  struct Hypothesis {
    DrivenCart cart;
    int departures = 0;
  };
  bool cart_is_stuck(const WatchedPeriod& period, bool counted) noexcept;
  bool pendulum_is_stuck(const WatchedPeriod& period, bool counted) noexcept;
  double parabola_tolerance_m() const noexcept;

  EncoderAssumptions assumptions_;
  double unseen_m_, rad_per_count_, m_per_count_;
  std::array<Hypothesis, 9> hypotheses_;
  CartPath path_;
  Silence cart_, pendulum_;
  double moved_since_s_ = 0.0;  ///< the time since which all hypotheses have moved
  bool every_moved_ = false;
  double last_s_ = 0.0, last_v_ = 0.0;
  bool started_ = false;
};

}  // namespace upright
