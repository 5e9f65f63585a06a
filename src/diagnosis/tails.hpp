// The heaviness of the tails of numbers with an expected variance of at least 1, and of Student's t.
#pragma once

#include <vector>

namespace upright {

/// Of numbers with an expected mean of 0 and a variance of at least 1: 3 for a Gaussian. Numbers that scatter
/// by less have no heavy tails: it is smaller for them.
double kurtosis_of(const std::vector<double>& values);

/// The magnitude of a Gaussian variable that is as unlikely as Student's t with these degrees of freedom (at
/// least one): where few numbers scatter, their scatter is not well known. Wallace's approximation.
double normal_deviate(double t, double freedom);

}  // namespace upright
