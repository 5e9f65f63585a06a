// Histograms of durations as a table for a terminal, side by side.
#pragma once

#include <string>
#include <vector>

#include "upright/record/timing_stats.hpp"

namespace upright {

struct NamedHistogram {
  std::string name;  ///< at most 20 characters
  const DurationHistogram& durations;
};

/// A header line, then a line for each of the bins 1, 2, 5, 10, ... microseconds from the first to the last
/// that is not empty in all of them, with count and bar. A bar is as long as the logarithm of its count, so
/// that one late wake-up among ten thousand is seen. Up to three histograms fit into 100 columns. Bins begin
/// and end within 1/16 of what they say, which is how finely a DurationHistogram counts. Empty when nothing
/// was counted.
std::vector<std::string> histogram_lines(const std::vector<NamedHistogram>& histograms);

}  // namespace upright
