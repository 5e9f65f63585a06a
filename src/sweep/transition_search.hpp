// The search for the delays at which one start begins to oscillate and to fall: first among the delays of the
// sweep, by halving the list, then between two of them, by bisection.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "sweep.hpp"

namespace upright {

/// Where the outcome becomes `from` or worse.
class TransitionBracket {
 public:
  /// Between two delays of the list, by index: not yet at `low`, but at `high`. -1 and the number of delays
  /// are outside of it.
  TransitionBracket(Outcome from, std::ptrdiff_t low, std::ptrdiff_t high)
      : from_(from), low_(low), high_(high) {}

  bool on_list() const { return high_ - low_ > 1; }
  /// The delay that tells more; none: the bracket is closed, or has no end within the list.
  std::optional<double> wanted(std::span<const double> delays) const;
  /// Takes the outcome at the delay that was wanted.
  void narrow(std::span<const double> delays, Outcome outcome);
  /// The smallest delay at which the outcome was seen; NaN: it was not.
  double found_s(std::span<const double> delays) const;
  /// Its ends, before it left the list.
  std::array<double, 2> range() const { return {static_cast<double>(low_), static_cast<double>(high_)}; }

 private:
  double low_s(std::span<const double> delays) const;

  Outcome from_;
  std::ptrdiff_t low_, high_;
  std::optional<double> low_s_, high_s_;  ///< ends that are between delays of the list
};

class StartSearch {
 public:
  /// Among all delays of the sweep.
  StartSearch(const SweepConfig& config, double theta0_rad);
  /// Between two delays of the grid, whose runs are by delay.
  StartSearch(const SweepConfig& config, std::span<const SweepRun> grid);

  /// Numbers that tell a search that has not left the list.
  static constexpr std::size_t numbers = 5;
  std::array<double, numbers> as_numbers() const;
  StartSearch(const SweepConfig& config, std::span<const double, numbers> from);

  /// A run that it wants and has not asked for. `on_list`: only with a delay of the sweep.
  std::optional<LoopCase> next(bool on_list = false);
  /// Takes a run that it asked for.
  void take(const SweepRun& run);

  double theta0_rad() const { return theta0_rad_; }
  /// How many of its brackets want a run.
  std::size_t open() const;
  Transition transition() const;

 private:
  const SweepConfig* config_;
  double theta0_rad_;
  std::array<TransitionBracket, 2> brackets_;  ///< of the oscillation and of the fall
  std::array<bool, 2> asked_{};
};

/// Takes searches to their ends with runs that were made for them. False, with nothing written to `ended`: a
/// run is missing, or there are more than the searches need.
bool follow(std::vector<StartSearch> searches, std::span<const SweepRun> runs, std::span<StartSearch> ended);

}  // namespace upright
