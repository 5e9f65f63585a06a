// Several closed-loop runs at once on SIMD lanes: the engine of sweeps.
#pragma once

#include <span>

#include "lane_count.hpp"
#include "upright/sim/loop/loop_run.hpp"

namespace upright {

/// Whether `run_on_lanes` can do these runs. What it leaves to the event engine: delay compensation, motor
/// lag, dry friction of the pivot, a cart alone, stiff bristles and other plants much faster than a
/// millisecond, and the plant's own input delay in a sampled loop.
bool lanes_can_run(const LoopSetup& setup);

/// Any number of runs, `lane_count` side by side.
///
/// Sampled loops: by RK4 with extra substeps where the friction turns; with true stick-slip a lane in which
/// the cart stops or breaks away is taken through that period by the event engine. A run that fell costs
/// nothing more once all beside it did. A result depends on the runs that share its lanes in the last digits,
/// so callers keep groups fixed.
///
/// Continuous loops: each with its own adaptive steps and its own events.
void run_on_lanes(const LoopSetup& setup, std::span<const LoopCase> cases, std::span<LoopResult> results);

}  // namespace upright
