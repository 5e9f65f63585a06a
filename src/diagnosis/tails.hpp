// The heaviness of the tails of numbers with an expected variance of at least 1, and of Student's t.
#pragma once

#include <vector>

namespace upright {

/// Of numbers with an expected mean of 0 and a variance of at least 1: 3 for a Gaussian. Numbers that scatter
/// by less have no heavy tails: it is smaller for them.
double kurtosis_of(const std::vector<double>& values);

/// The numbers without the growth of their scatter with a speed: each divided by sqrt(1 + r u^2), u its speed
/// over the rms speed, with the r of a ladder under which they are the most likely Gaussians. Their mean
/// square stays. `speeds`: one for each, or all zero.
std::vector<double> without_growth(std::vector<double> values, const std::vector<double>& speeds);

/// The magnitude of a Gaussian variable that is as unlikely as Student's t with these degrees of freedom (at
/// least one): where few numbers scatter, their scatter is not well known. Wallace's approximation.
double normal_deviate(double t, double freedom);

}  // namespace upright
