#include "tails.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace upright {

double normal_deviate(double t, double freedom) {
  return std::sqrt(freedom * std::log1p(t * t / freedom)) * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0);
}

std::vector<double> without_growth(std::vector<double> values, const std::vector<double>& speeds) {
  const auto n = static_cast<double>(values.size());
  double mean_square_speed = 0.0;
  for (const double u : speeds) mean_square_speed += u * u / n;
  if (!(mean_square_speed > 0.0)) return values;
  const auto variance_at = [&](double ratio, std::size_t i) {
    return 1.0 + ratio * speeds[i] * speeds[i] / mean_square_speed;
  };
  const auto mean_square = [&](double ratio) {
    double sum = 0.0;
    for (std::size_t i = 0; i < values.size(); ++i) sum += values[i] * values[i] / variance_at(ratio, i);
    return sum / n;
  };
  if (!(mean_square(0.0) > 0.0)) return values;
  double likeliest = 0.0, least = std::numeric_limits<double>::infinity();
  for (const double ratio : {0.0, 0.25, 1.0, 4.0, 16.0, 64.0}) {
    double deviance = n * std::log(mean_square(ratio));
    for (std::size_t i = 0; i < values.size(); ++i) deviance += std::log(variance_at(ratio, i));
    if (!(deviance < least)) continue;
    least = deviance;
    likeliest = ratio;
  }
  const double scale = std::sqrt(mean_square(0.0) / mean_square(likeliest));
  for (std::size_t i = 0; i < values.size(); ++i) values[i] *= scale / std::sqrt(variance_at(likeliest, i));
  return values;
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
