// How heavy the tails of numbers are that should have a variance of 1 at least.
#pragma once

#include <vector>

namespace upright {

struct Tails {
  double kurtosis = 3.0;   ///< 3: as a Gaussian's
  double certainty = 0.0;  ///< that they are heavier than a Gaussian's [standard errors of so many numbers]
};

/// Of numbers whose mean should be 0. Where they scatter by less than 1, no tail of theirs is heavy. Fewer
/// than 30 numbers show nothing. Certainty: Anscombe and Glynn, Biometrika 70 (1983) 227.
Tails tails_of(const std::vector<double>& values);

}  // namespace upright
