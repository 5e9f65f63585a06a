// Measured runs cut into segments, for multiple shooting.
#pragma once

#include <cstddef>
#include <vector>

#include "upright/estimation/work_bound.hpp"
#include "upright/measurement/measurement.hpp"

namespace upright {

/// Samples first..last (inclusive) of a run, simulated from one initial state.
struct Segment {
  std::size_t run = 0;
  std::size_t first = 0;
  std::size_t last = 0;
};

/// Cuts runs into segments: at gaps in the record, and so short that a small error does not grow out of
/// proportion where the pendulum stands upright.
std::vector<Segment> cut_segments(const std::vector<Measurement>& runs, double longest_s = 2.0);

/// What a fit works on.
struct FitData {
  const std::vector<Measurement>* runs = nullptr;
  std::vector<Segment> segments;
  WorkBound* bound = nullptr;  ///< of the search that the fit is a part of; null: none
};

}  // namespace upright
