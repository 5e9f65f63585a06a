#include "tails.hpp"

#include <algorithm>
#include <cmath>

namespace upright {

double normal_deviate(double t, double freedom) {
  return std::sqrt(freedom * std::log1p(t * t / freedom)) * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0);
}

Tails tails_of(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  constexpr double min_count = 30.0;
  if (n < min_count) return {};
  double second = 0.0, fourth = 0.0;
  for (const double v : values) {
    second += v * v;
    fourth += v * v * v * v;
  }
  Tails tails;
  tails.kurtosis = fourth * n / std::pow(std::max(second, n), 2);
  // A Gaussian variable of the kurtosis of n Gaussian numbers.
  const double mean = 3.0 * (n - 1.0) / (n + 1.0);
  if (tails.kurtosis <= mean) return tails;
  const double variance = 24.0 * n * (n - 2.0) * (n - 3.0) / ((n + 1.0) * (n + 1.0) * (n + 3.0) * (n + 5.0));
  const double skewness = 6.0 * (n * n - 5.0 * n + 2.0) / ((n + 7.0) * (n + 9.0)) *
                          std::sqrt(6.0 * (n + 3.0) * (n + 5.0) / (n * (n - 2.0) * (n - 3.0)));
  const double degrees =
      6.0 + 8.0 / skewness * (2.0 / skewness + std::sqrt(1.0 + 4.0 / (skewness * skewness)));
  const double off = (tails.kurtosis - mean) / std::sqrt(variance);
  const double ratio = (1.0 - 2.0 / degrees) / (1.0 + off * std::sqrt(2.0 / (degrees - 4.0)));
  tails.certainty = (1.0 - 2.0 / (9.0 * degrees) - std::cbrt(ratio)) / std::sqrt(2.0 / (9.0 * degrees));
  return tails;
}

}  // namespace upright
