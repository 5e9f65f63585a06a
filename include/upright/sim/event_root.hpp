// The time of an event: where its indicator becomes positive within a step.
#pragma once

#include <cmath>
#include <optional>

namespace upright {

/// Time within [0, h] at which f becomes positive, given f(h) = f_high > 0. If f(0) = f_low is not
/// negative (the last event was this one), the search starts at a time at which f is negative; 0 where
/// there is none. At most about 120 evaluations.
template <class F>
double turning_positive(F&& f, double f_low, double f_high, double h, double tolerance_s = 1e-14) {
  constexpr int max_iterations = 60;
  constexpr double nearest_s = 1e-14;
  double low = 0.0, high = h;
  if (!(f_low < 0.0)) {
    double inside = h;
    for (int i = 0; i < max_iterations && inside > nearest_s; ++i) {
      inside *= 0.5;
      const double f_inside = f(inside);
      if (f_inside < 0.0) {
        low = inside;
        f_low = f_inside;
        break;
      }
      high = inside;
      f_high = f_inside;
    }
    if (!(f_low < 0.0)) return 0.0;
  }
  for (int i = 0; i < max_iterations && high - low > tolerance_s; ++i) {
    double t = high - f_high * (high - low) / (f_high - f_low);
    if (!(t > low && t < high) || i % 4 == 3) t = 0.5 * (low + high);
    const double f_t = f(t);
    if (f_t == 0.0) return t;
    if (f_t > 0.0) {
      high = t;
      f_high = f_t;
      f_low *= 0.5;
    } else {
      low = t;
      f_low = f_t;
      f_high *= 0.5;
    }
  }
  return high;
}

/// An indicator at a time.
struct IndicatorSlope {
  double value;        ///< of the indicator
  double slope_per_s;  ///< its rate of change
};

/// The first time within [0, h] at which an indicator with f(0) < 0 < f(h) is zero, if its slope hardly
/// changes: of the parabola with these two values and this slope at 0.
inline double first_guess(double f_low, double slope_per_s, double f_high, double h) {
  const double bend = (f_high - f_low - slope_per_s * h) / (h * h);
  const double discriminant = slope_per_s * slope_per_s - 4.0 * bend * f_low;
  const double t = -2.0 * f_low / (slope_per_s + std::sqrt(discriminant));
  return t > 0.0 && t < h ? t : h * f_low / (f_low - f_high);
}

/// The same time by Newton's method, with few evaluations: `f(t)` returns IndicatorSlope. Nothing where it
/// does not settle within [0, h] from this guess.
template <class F>
std::optional<double> newton_root(F&& f, double guess, double h, double tolerance_s) {
  constexpr int max_evaluations = 5;
  // By how much the slope changes within a second, relative to itself, at most: half of that times the
  // square of a step remains as the error.
  constexpr double bend_per_s = 2e3;
  double t = guess;
  for (int i = 0; i < max_evaluations; ++i) {
    const IndicatorSlope at = f(t);
    if (!(at.slope_per_s > 0.0)) return std::nullopt;
    const double step = at.value / at.slope_per_s;
    t -= step;
    if (!(t >= 0.0 && t <= h)) return std::nullopt;
    if (0.5 * bend_per_s * step * step <= tolerance_s) return t;
  }
  return std::nullopt;
}

}  // namespace upright
