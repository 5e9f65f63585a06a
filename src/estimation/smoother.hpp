// The residual as a force on the cart and a torque on the pendulum, estimated by a Kalman smoother along the
// simulated trajectory. Force and torque are additional states that follow random walks.
#pragma once

#include <array>
#include <vector>

#include "fit.hpp"
#include "upright/estimation/residual_trace.hpp"

namespace upright {

/// The residual force and torque as random walks.
struct ResidualWalk {
  // The intensities of the walks: their typical size within a few hundredths of a second. For a small cart.
  // Chosen.
  double force_n_per_sqrt_s = 3.0;
  double torque_nm_per_sqrt_s = 0.3;
  /// Variances at the beginning of a segment: of position, angle, their rates, the bristles' deflection, and
  /// position and velocity of an attached mass [m2, rad2, (m/s)2, (rad/s)2, m2, m2, (m/s)2], and of the
  /// residual force and torque [N2, (N m)2]. For a small cart. Chosen.
  std::array<double, 9> start_variances = {1e-6, 1e-4, 1e-2, 1e-1, 1e-6, 1e-6, 1e-2, 4.0, 0.04};
};

/// One trace per segment, in the order of the segments.
std::vector<ResidualTrace> smooth_residuals(const FitData& data, const FitPoint& point,
                                            const ResidualWalk& walk);

}  // namespace upright
