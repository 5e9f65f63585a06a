// The motion of a record over short windows, for comparison with the equations of motion while noise,
// friction and units are unknown.
#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace upright {

/// Level, rate and acceleration of a channel in the middle of each window.
struct WindowedMotion {
  std::vector<double> level, rate, acceleration;
  double acceleration_noise = 0.0;  ///< standard deviation, from the residuals of the parabolas
};

/// Windows of equal length over a record, without those that contain a gap.
class MotionWindows {
 public:
  /// `breaks` as in Measurement. Around each window there are samples for `margin_s`.
  MotionWindows(const std::vector<double>& time_s, const std::vector<std::size_t>& breaks, double length_s,
                double margin_s = 0.0);

  std::size_t size() const { return windows_.size(); }
  /// The motion of values that were recorded `later_s` after the measurement; at most the margin.
  WindowedMotion motion(const std::vector<double>& values, double later_s = 0.0) const;
  /// The mean of values that are constant from row to row, as of `earlier_s` before, weighted like the
  /// acceleration of a parabola.
  std::vector<double> held(const std::vector<double>& values, double earlier_s) const;

 private:
  /// The first and last sample of a shifted window.
  std::pair<std::size_t, std::size_t> moved(std::size_t window, double by_s) const;

  const std::vector<double>& time_s_;
  double length_s_;
  std::vector<std::pair<std::size_t, std::size_t>> windows_;  ///< first and last sample
};

}  // namespace upright
