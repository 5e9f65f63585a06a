// Maximum likelihood estimation of the noise of the filter, along linearised segments.
#pragma once

#include <vector>

#include "linearisation.hpp"

namespace upright {

/// Minus twice the log likelihood of the data with each of these noises, side by side in SIMD lanes. Infinite
/// where it is not finite.
std::vector<double> noise_objectives(const FitData& data, const Plant& plant,
                                     const std::vector<LinearisedSegment>& linearised,
                                     const std::vector<Noise>& noises);

/// Maximum likelihood estimate of the noise of a point: a pattern search with these factors, each finer than
/// the one before, and Newton steps at the end. The coloured part is estimated only if
/// wanted. Returns the fall of the objective.
double estimate_noise(const FitData& data, const std::vector<LinearisedSegment>& linearised,
                      const std::vector<double>& factors, bool coloured, FitPoint& point);

}  // namespace upright
