// Parallel simulation of closed loops on SIMD lanes: the engine of sweeps.
#pragma once

#include <cstdint>
#include <span>

#include "loop_run.hpp"
#include "loop_source.hpp"

namespace upright {

/// Whether `run_on_lanes` supports these runs. It excludes the extended Kalman filter, motor lags shorter
/// than 0.1 ms, a cart alone, and dynamics much faster than a millisecond. Stiff bristles are excluded in a
/// continuous loop, and beside motor lag or a pivot whose torque is not smooth at rest. In a continuous loop,
/// estimators, motor lag and a pivot that sticks are excluded too.
bool lanes_can_run(const LoopSetup& setup);

/// The target of the lanes: the registers of this processor, fastest, with last digits that differ
/// between processors; or the baseline, with identical bits on every machine.
enum class LaneRegisters : std::uint8_t { wide, baseline };

/// The number of runs that are simulated at once.
std::size_t runs_side_by_side(LaneRegisters registers = LaneRegisters::wide);

/// Simulates any number of runs.
///
/// Sampled loops: RK4. With smooth friction, additional substeps where it reverses, the same in all lanes:
/// the last digits of a result depend on the other runs of its group, so that callers keep groups fixed. A
/// fallen run causes no work there once all others in its group have fallen. Other lanes go at their own
/// pace: see `lanes_refill`.
///
/// Continuous loops: each with its own adaptive steps and its own events.
void run_on_lanes(const LoopSetup& setup, std::span<const LoopCase> cases, std::span<LoopResult> results,
                  LaneRegisters registers = LaneRegisters::wide);

/// The same with each of these plants in place of that of `setup`. All have its effects. Results by plant,
/// then by start. Lanes that refill take different plants at once.
void run_plants_on_lanes(const LoopSetup& setup, std::span<const PlantModel<double>> plants,
                         std::span<const LoopCase> cases, std::span<LoopResult> results,
                         LaneRegisters registers = LaneRegisters::wide);

/// The same for the runs of a source, until it has no more. A lane that has ended a run takes the next one at
/// once. Where `lanes_refill` is false, a result depends on the runs that the source gives together.
void run_source_on_lanes(const LoopSetup& setup, LoopSource& source,
                         LaneRegisters registers = LaneRegisters::wide);

/// Whether each lane goes at its own pace, and takes the next run of a call as soon as one has ended. Then a
/// result depends on its own run only, and calls with many runs leave few lanes empty. So do continuous
/// loops, and sampled ones with stick-slip or where a cart on bristles often reverses.
bool lanes_refill(const LoopSetup& setup);

}  // namespace upright
