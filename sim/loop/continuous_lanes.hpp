// Continuous loops with delay on SIMD lanes.
#pragma once

#include <span>

#include "loop_run.hpp"

namespace upright::UPRIGHT_LANES {

/// Any number of runs of a plant, side by side, each with its own time, step and delay; a lane whose run has
/// ended takes the next run. Results do not depend on the runs in other lanes.
void run_continuous_on_lanes(const LoopSetup& setup, const PlantModel<double>& plant,
                             std::span<const LoopCase> cases, std::span<LoopResult> results);

}  // namespace upright::UPRIGHT_LANES
