// The median of numbers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace upright {

/// The middle one of at least one number; of an even count, the larger of the two in the middle.
inline double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Of the magnitudes of Gaussian numbers, in standard deviations.
inline constexpr double median_of_gaussian_magnitudes = 0.6745;

}  // namespace upright
