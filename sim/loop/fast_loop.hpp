// Several closed-loop runs at once on SIMD lanes: the engine of sweeps.
#pragma once

#include <cstdint>
#include <span>

#include "upright/sim/loop/loop_run.hpp"

namespace upright {

/// Whether `run_on_lanes` can do these runs. What it leaves to the event engine: delay compensation, motor
/// lag, dry friction of the pivot, a cart alone, stiff bristles and other plants much faster than a
/// millisecond, and the plant's own input delay in a sampled loop.
bool lanes_can_run(const LoopSetup& setup);

/// What the lanes are compiled for: the registers of one processor, fastest, with last digits that differ
/// between processors; or the baseline's, with the same bits on every machine.
enum class LaneRegisters : std::uint8_t { wide, baseline };

/// How many runs the lanes take at once.
std::size_t runs_side_by_side(LaneRegisters registers = LaneRegisters::wide);

/// Any number of runs, so many side by side.
///
/// Sampled loops: by RK4 with extra substeps where the friction turns; with true stick-slip a lane in which
/// the cart stops or breaks away is taken through that period by the event engine. A run that fell costs
/// nothing more once all beside it did. A result depends on the runs that share its lanes in the last digits,
/// so callers keep groups fixed.
///
/// Continuous loops: each with its own adaptive steps and its own events.
void run_on_lanes(const LoopSetup& setup, std::span<const LoopCase> cases, std::span<LoopResult> results,
                  LaneRegisters registers = LaneRegisters::wide);

}  // namespace upright
