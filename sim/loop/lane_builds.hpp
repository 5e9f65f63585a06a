// The lanes are compiled from one source for several kinds of registers, each time in a separate namespace,
// UPRIGHT_LANES: baseline_lanes and wide_lanes; with UPRIGHT_DISPATCH avx2_lanes and avx512_lanes in place of
// wide_lanes.
#pragma once

#include <optional>
#include <span>

#include "control/kalman_step.hpp"
#include "lane_predictions.hpp"
#include "loop_run.hpp"
#include "loop_source.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

/// A stationary Kalman filter in the place of the velocity estimator.
struct LaneEstimator {
  KalmanStep step;
  PlantModel<double> model;  ///< its plant, for the static actuator chain
};

/// What the controllers know of their plants.
struct LaneParts {
  std::optional<LaneEstimator> estimator;
  LanePredictions* predictions = nullptr;  ///< null: the delay is not compensated
  /// Each lane goes at its own pace from event to event; otherwise all lanes go in step.
  bool own_pace = false;
  bool stiff_bristles = false;  ///< they relax too fast for the classical method
  bool short_series = false;    ///< few terms of a Taylor series tell the motion over a period
  /// At its own pace: the pendulum may stick in its pivot, or the motor lags.
  bool pivot_or_lag = false;
};

}  // namespace upright

#define UPRIGHT_DECLARE_LANES(name)                                                                    \
  namespace name {                                                                                     \
  std::size_t runs_side_by_side();                                                                     \
  /* Until the source has no more. Several plants only where each lane goes at its own pace. */        \
  void run(const LoopSetup& setup, const LaneParts& parts, std::span<const PlantModel<double>> plants, \
           LoopSource& source);                                                                        \
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
