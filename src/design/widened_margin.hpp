// Gains, and force noise of a Kalman filter, with the largest delay margin for a given loss of LQR cost.
#pragma once

#include <array>
#include <complex>
#include <vector>

#include "gain_design.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

struct MarginRequest {
  DesignWeights weights;
  double smoothing = 100.0;
  double cost_loss = 0.0;     ///< largest one allowed (GainCost::loss)
  double unmodelled_s = 0.0;  ///< unmodelled delay of the actuator that the loop must tolerate [s]
};

struct WidenedMargin {
  std::array<double, 4> gains{};                        ///< as in GainDesign
  std::vector<std::complex<double>> closed_loop_poles;  ///< without delay [1/s]
  double cost_loss = 0.0;                               ///< of these gains
  double critical_s = 0.0, lqr_critical_s = 0.0;        ///< critical delay of these, and of the optimal gains
};

/// Replaces gains and poles of a design.
void adopt(const WidenedMargin& widened, GainDesign& design);

/// Changes the gains of `config` and the force noise of its state estimator. `config` has the optimal gains
/// for the weights, no predictor, and the delay of the loop. The margin is that of the sampled loop on the
/// sliding plant `plant`, for a delay that the estimator knows. The search is local and derivative-free
/// (COBYLA of NLopt; Powell 1994). Throws ConfigError when no gains within the loss hold the plant at that
/// delay.
WidenedMargin widen_margin(const Plant& plant, const MarginRequest& request, ControlConfig& config);

}  // namespace upright
