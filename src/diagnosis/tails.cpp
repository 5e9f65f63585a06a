#include "tails.hpp"

#include <algorithm>
#include <cmath>

namespace upright {

double normal_deviate(double t, double freedom) {
  return std::sqrt(freedom * std::log1p(t * t / freedom)) * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0);
}

double kurtosis_of(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  double second = 0.0, fourth = 0.0;
  for (const double v : values) {
    second += v * v;
    fourth += v * v * v * v;
  }
  return fourth * n / std::pow(std::max(second, n), 2);
}

}  // namespace upright
