// A record with fewer samples, for a search: what decides in the end is judged on all of them.
#pragma once

#include <vector>

#include "segments.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// Every few samples of each run, about `period_s` apart. Between two of them the voltage is held at its
/// mean, and a sample is kept wherever the mean would move the cart by more than the sensor's noise. Gaps
/// stay gaps.
std::vector<Measurement> coarse_runs(const std::vector<Measurement>& runs, const Plant& plant,
                                     double period_s);

/// The same segments of coarse runs, as far as they have enough samples there.
std::vector<Segment> coarse_segments(const std::vector<Segment>& segments,
                                     const std::vector<Measurement>& runs,
                                     const std::vector<Measurement>& coarse);

}  // namespace upright
