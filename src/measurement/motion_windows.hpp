// A record's motion over short windows: what the equations of motion are held against when nothing is known
// yet of noise, friction or units.
#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace upright {

/// Level, rate and acceleration of a channel in the middle of each window.
struct WindowedMotion {
  std::vector<double> level, rate, acceleration;
  double acceleration_noise = 0.0;  ///< standard deviation, from what the parabolas leave
};

/// Windows of equal length over a record; those with a gap in them are left out.
class MotionWindows {
 public:
  /// `breaks` as in Measurement. Around each window there are samples for `margin_s`.
  MotionWindows(const std::vector<double>& time_s, const std::vector<std::size_t>& breaks, double length_s,
                double margin_s = 0.0);

  std::size_t size() const { return windows_.size(); }
  /// Of values that were written down `later_s` after they had been measured, no more than the margin.
  WindowedMotion motion(const std::vector<double>& values, double later_s = 0.0) const;
  /// Mean of values that are held from row to row, as they were `earlier_s` before, with the weight that a
  /// parabola gives to the acceleration.
  std::vector<double> held(const std::vector<double>& values, double earlier_s) const;

 private:
  /// First and last sample of a window that is moved.
  std::pair<std::size_t, std::size_t> moved(std::size_t window, double by_s) const;

  const std::vector<double>& time_s_;
  double length_s_;
  std::vector<std::pair<std::size_t, std::size_t>> windows_;  ///< first and last sample
};

}  // namespace upright
