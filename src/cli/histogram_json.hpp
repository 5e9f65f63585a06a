// How long something took, in a command's JSON document.
#pragma once

#include <nlohmann/json.hpp>

#include "upright/record/timing_stats.hpp"

namespace upright::cli {

/// Count, mean, percentiles, largest, and the histogram: buckets by their upper ends, empty ones left out.
nlohmann::ordered_json histogram_json(const DurationHistogram& durations);

}  // namespace upright::cli
