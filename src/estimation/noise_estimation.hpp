// Maximum likelihood estimation of the noise of the filter, along linearised segments.
#pragma once

#include <vector>

#include "linearisation.hpp"

namespace upright {

/// Minus twice the log likelihood of the data with another noise.
double noise_objective(const FitData& data, const Plant& plant,
                       const std::vector<LinearisedSegment>& linearised, const Noise& noise);

/// Maximum likelihood estimate of the noise of a point, by a pattern search with these factors, which become
/// finer; its coloured part only if wanted. Returns the fall of the objective.
double estimate_noise(const FitData& data, const std::vector<LinearisedSegment>& linearised,
                      const std::vector<double>& factors, bool coloured, FitPoint& point);

}  // namespace upright
