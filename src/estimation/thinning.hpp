// Which segments of many data to work on.
#pragma once

#include <vector>

#include "upright/estimation/segments.hpp"

namespace upright {

/// Segments in which something moves; those that rest say nothing more than that they rest.
std::vector<Segment> moving_segments(const std::vector<Measurement>& runs);

/// Every n-th segment, so that about `most` samples are left and every run keeps its share.
std::vector<Segment> thinned(const std::vector<Segment>& segments, double most);

}  // namespace upright
