// The lanes are compiled twice from the same source, each time in a separate namespace: UPRIGHT_LANES is
// wide_lanes or baseline_lanes.
#pragma once

#include <span>

#include "upright/sim/loop/loop_run.hpp"

namespace upright {

namespace wide_lanes {
std::size_t runs_side_by_side();
void run(const LoopSetup& setup, std::span<const LoopCase> cases, std::span<LoopResult> results);
}  // namespace wide_lanes

namespace baseline_lanes {
std::size_t runs_side_by_side();
void run(const LoopSetup& setup, std::span<const LoopCase> cases, std::span<LoopResult> results);
}  // namespace baseline_lanes

}  // namespace upright
