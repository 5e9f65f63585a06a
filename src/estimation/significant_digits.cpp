#include "significant_digits.hpp"

#include <algorithm>
#include <cmath>

namespace upright {

namespace {

/// Powers of ten up to this one are exact in double precision.
constexpr int max_exact_exponent = 22;

double power_of_ten(int exponent) {
  double power = 1.0;
  for (int i = 0; i < exponent; ++i) power *= 10.0;
  return power;
}

}  // namespace

double rounded_to_significant_digits(double value, double standard_error) {
  if (!(standard_error > 0.0) || !std::isfinite(standard_error) || !std::isfinite(value)) return value;
  const int exponent = static_cast<int>(std::floor(std::log10(standard_error))) - 2;
  if (std::abs(exponent) > max_exact_exponent) return value;
  const double power = power_of_ten(std::abs(exponent));
  return exponent < 0 ? std::round(value * power) / power : std::round(value / power) * power;
}

void round_to_significant_digits(FitResult& fitted, const std::vector<FreeParameter>& free) {
  for (std::size_t j = 0; j < free.size(); ++j) {
    const FreeParameter& p = free[j];
    const auto at = static_cast<Eigen::Index>(j);
    auto values = fitted.point.plant.find(p.effect)->values;
    const double value = values[p.index];
    if (value <= p.low || value >= p.high) continue;
    const double rounded = rounded_to_significant_digits(value, 1.0 / std::sqrt(fitted.information(at, at)));
    values[p.index] = std::clamp(rounded, p.low, p.high);
    fitted.point.plant.set(p.effect, values);
  }
}

}  // namespace upright
