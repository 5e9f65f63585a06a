// The few statistics that reports show.
#pragma once

#include <vector>

namespace upright {

struct Spread {
  double median = 0.0;
  double p99 = 0.0;
  double p999 = 0.0;
  double largest = 0.0;
};

/// Of the finite values; all zero when there are none.
Spread spread_of(std::vector<double> values);

/// Largest magnitude among the finite values; 0 when there are none.
double largest_magnitude(const std::vector<double>& values);

/// Root of the mean square of the finite values; 0 when there are none.
double root_mean_square(const std::vector<double>& values);

}  // namespace upright
