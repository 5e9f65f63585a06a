// Student's quantile, for intervals of means of few values.
#pragma once

#include <cstddef>

namespace upright {

/// Two-sided 95 percent, to a thousandth; from one degree of freedom on.
double student_quantile(std::size_t degrees_of_freedom);

}  // namespace upright
