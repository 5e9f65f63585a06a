#include "student.hpp"

#include <algorithm>
#include <array>

namespace upright {

double student_quantile(std::size_t degrees_of_freedom) {
  constexpr std::array<double, 20> few = {12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365,
                                          2.306,  2.262, 2.228, 2.201, 2.179, 2.160, 2.145,
                                          2.131,  2.120, 2.110, 2.101, 2.093, 2.086};
  const std::size_t n = std::max<std::size_t>(degrees_of_freedom, 1);
  if (n <= few.size()) return few[n - 1];
  // Its expansion about the normal distribution's quantile.
  constexpr double z = 1.959964, z3 = z * z * z, z5 = z3 * z * z;
  const auto nu = static_cast<double>(n);
  return z + (z3 + z) / (4.0 * nu) + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * nu * nu);
}

}  // namespace upright
