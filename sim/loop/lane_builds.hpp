// The lanes are compiled from one source for several kinds of registers, each time in a separate namespace,
// UPRIGHT_LANES: baseline_lanes and wide_lanes; with UPRIGHT_DISPATCH avx2_lanes and avx512_lanes in place of
// wide_lanes.
#pragma once

#include <span>

#include "control/kalman_step.hpp"
#include "upright/model/dynamics.hpp"
#include "upright/sim/loop/loop_run.hpp"

namespace upright {

/// A stationary Kalman filter in the place of the velocity estimator.
struct LaneEstimator {
  KalmanStep step;
  PlantModel<double> model;  ///< its plant, for the static actuator chain
};

}  // namespace upright

#define UPRIGHT_DECLARE_LANES(name)                                                                 \
  namespace name {                                                                                  \
  std::size_t runs_side_by_side();                                                                  \
  void run(const LoopSetup& setup, const LaneEstimator* estimator, std::span<const LoopCase> cases, \
           std::span<LoopResult> results);                                                          \
  }

namespace upright {

UPRIGHT_DECLARE_LANES(baseline_lanes)
#ifdef UPRIGHT_DISPATCH
UPRIGHT_DECLARE_LANES(avx2_lanes)
UPRIGHT_DECLARE_LANES(avx512_lanes)
#else
UPRIGHT_DECLARE_LANES(wide_lanes)
#endif

}  // namespace upright
