// Continuous loops with delay on SIMD lanes.
#pragma once

#include <span>

#include "upright/sim/loop/loop_run.hpp"

namespace upright::UPRIGHT_LANES {

/// Any number of runs, side by side, each with its own clock, step and delay; a lane that ends
/// takes the next run. A result does not depend on the runs beside it.
void run_continuous_on_lanes(const LoopSetup& setup, std::span<const LoopCase> cases,
                             std::span<LoopResult> results);

}  // namespace upright::UPRIGHT_LANES
