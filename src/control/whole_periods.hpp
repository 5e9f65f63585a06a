// A delay as whole sample periods and the fraction of one that remains.
#pragma once

#include <cmath>
#include <cstddef>

namespace upright {

/// A delay this near to a whole number of periods is that number, as in the delay line.
inline constexpr double whole_tolerance_periods = 1e-9;

struct WholePeriods {
  std::size_t whole = 0;
  double fraction = 0.0;  ///< of a period, 0 or above the tolerance
};

inline WholePeriods whole_periods(double delay_s, double period_s) {
  const double periods = delay_s / period_s;
  const double whole = std::floor(periods + whole_tolerance_periods);
  const double fraction = periods - whole;
  return {static_cast<std::size_t>(whole), fraction > whole_tolerance_periods ? fraction : 0.0};
}

/// The number of periods that begin within a delay.
inline std::size_t periods_within(double delay_s, double period_s) {
  return static_cast<std::size_t>(std::ceil(delay_s / period_s - whole_tolerance_periods));
}

}  // namespace upright
