// Parallel simulation of closed loops on SIMD lanes: the engine of sweeps.
#pragma once

#include <cstdint>
#include <span>

#include "upright/sim/loop/loop_run.hpp"

namespace upright {

/// Whether `run_on_lanes` supports these runs. It excludes the extended Kalman filter, motor lags shorter
/// than 0.1 ms, a cart alone, stiff bristles and other dynamics much faster than a millisecond, and in a
/// continuous loop estimators, motor lag and a pivot that sticks.
bool lanes_can_run(const LoopSetup& setup);

/// The target of the lanes: the registers of this processor, fastest, with last digits that differ
/// between processors; or the baseline, with identical bits on every machine.
enum class LaneRegisters : std::uint8_t { wide, baseline };

/// The number of runs that are simulated at once.
std::size_t runs_side_by_side(LaneRegisters registers = LaneRegisters::wide);

/// Simulates any number of runs, in groups.
///
/// Sampled loops: RK4. With smooth friction, additional substeps where it reverses, the same in all lanes:
/// the last digits of a result depend on the other runs of its group, so that callers keep groups fixed. With
/// stick-slip, and where a cart on bristles often reverses, each lane steps to its own events, and its result
/// depends on nothing else. A fallen run causes no work once all others in its group have fallen.
///
/// Continuous loops: each with its own adaptive steps and its own events.
void run_on_lanes(const LoopSetup& setup, std::span<const LoopCase> cases, std::span<LoopResult> results,
                  LaneRegisters registers = LaneRegisters::wide);

}  // namespace upright
