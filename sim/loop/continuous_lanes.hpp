// Continuous loops with delay on SIMD lanes.
#pragma once

#include "loop_run.hpp"
#include "loop_source.hpp"

namespace upright::UPRIGHT_LANES {

/// The runs of a source on this plant, side by side, each with its own time, step and delay; a lane whose run
/// has ended takes the next run. Results do not depend on the runs in other lanes.
void run_continuous_on_lanes(const LoopSetup& setup, const PlantModel<double>& plant, LoopSource& source);

}  // namespace upright::UPRIGHT_LANES
