// Segments of measured runs, for multiple shooting.
#pragma once

#include <cstddef>
#include <vector>

#include "upright/measurement/measurement.hpp"
#include "work_bound.hpp"

namespace upright {

/// Samples first..last (inclusive) of a run, simulated from one initial state.
struct Segment {
  std::size_t run = 0;    ///< number of the run, from 0
  std::size_t first = 0;  ///< its first sample
  std::size_t last = 0;   ///< its last sample
};

/// Whether rows are missing before sample k: it is one of `breaks`, or comes more than five of these periods
/// after the one before it.
bool is_gap(const Measurement& run, std::size_t k, double period_s);

/// The samples before which rows are missing: those that is_gap() finds with the median period. What was
/// commanded in a gap is not known.
std::vector<std::size_t> gaps_in(const Measurement& run);

/// Cuts runs into segments: at gaps in the record, and short enough that the instability of the upright
/// pendulum does not amplify a small error excessively.
std::vector<Segment> cut_segments(const std::vector<Measurement>& runs, double longest_s = 2.0);

/// The largest voltage within a segment, without its sign [V].
double largest_voltage_v(const std::vector<Measurement>& runs, const Segment& segment);

/// The data of a fit.
struct FitData {
  const std::vector<Measurement>* runs = nullptr;  ///< they must outlive this
  std::vector<Segment> segments;                   ///< in the order of the runs
  WorkBound* bound = nullptr;                      ///< of the search to which the fit belongs; null: none
};

/// The largest voltage within all segments, without its sign [V]; 0 without a segment.
double largest_voltage_v(const FitData& data);

/// The place of a segment with this voltage. There must be a segment.
std::size_t most_driven_segment(const FitData& data);

}  // namespace upright
