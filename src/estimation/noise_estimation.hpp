// The noise of the filter, by maximum likelihood along segments that are linearised.
#pragma once

#include <vector>

#include "linearisation.hpp"

namespace upright {

/// Minus twice the log likelihood of the data, had the noise been another.
double noise_objective(const FitData& data, const Plant& plant,
                       const std::vector<LinearisedSegment>& linearised, const Noise& noise);

/// Maximum likelihood of the noise of a point by a pattern search with these factors, finer and finer. By how
/// much it brings the objective down.
double estimate_noise(const FitData& data, const std::vector<LinearisedSegment>& linearised,
                      const std::vector<double>& factors, FitPoint& point);

}  // namespace upright
