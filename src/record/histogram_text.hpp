// Histograms of durations side by side, as a table for a terminal.
#pragma once

#include <string>
#include <vector>

#include "upright/record/timing_stats.hpp"

namespace upright {

struct NamedHistogram {
  std::string name;  ///< at most 20 characters
  const DurationHistogram& durations;
};

/// A header line, then one line per bin 1, 2, 5, 10, ... microseconds, from the first to the last
/// that is not empty in all histograms, with count and bar. The length of a bar is logarithmic, so
/// that a single late wake-up among ten thousand is visible. Up to three histograms fit into 100
/// columns. Bin limits are accurate to 1/16, the resolution of a DurationHistogram. Empty when
/// nothing was counted.
std::vector<std::string> histogram_lines(const std::vector<NamedHistogram>& histograms);

}  // namespace upright
