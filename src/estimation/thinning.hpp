// The choice of segments if the data are many.
#pragma once

#include <vector>

#include "segments.hpp"

namespace upright {

/// Segments with motion. Segments at rest carry no other information.
std::vector<Segment> moving_segments(const std::vector<Measurement>& runs);

/// Every n-th segment, so that about `max_samples` samples remain and each run keeps its share.
std::vector<Segment> thinned(const std::vector<Segment>& segments, double max_samples);

}  // namespace upright
