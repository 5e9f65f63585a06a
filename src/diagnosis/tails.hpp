// The heaviness of the tails of numbers with an expected variance of at least 1, and of Student's t.
#pragma once

#include <vector>

namespace upright {

struct Tails {
  double kurtosis = 3.0;   ///< 3 for a Gaussian
  double certainty = 0.0;  ///< of tails heavier than a Gaussian's [standard errors for this count]
};

/// For numbers with an expected mean of 0. If they scatter by less than 1, the tails are not heavy. Fewer
/// than 30 numbers give no result. Certainty: Anscombe and Glynn, Biometrika 70 (1983) 227.
Tails tails_of(const std::vector<double>& values);

/// The magnitude of a Gaussian variable that is as unlikely as Student's t with these degrees of freedom (at
/// least one): where few numbers scatter, their scatter is not well known. Wallace's approximation.
double normal_deviate(double t, double freedom);

}  // namespace upright
