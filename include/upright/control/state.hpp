// The state the controller works with, in SI units.
#pragma once

namespace upright {

/// Measured positions and estimated velocities. theta is 0 upright, positive when leaning toward +x.
struct ControlState {
  double cart_m = 0.0;
  double theta_rad = 0.0;
  double cart_velocity_mps = 0.0;
  double pendulum_rate_radps = 0.0;
  // Known to a model-based estimator only.
  double motor_v = 0.0;       ///< behind a motor lag that its plant file has
  double cart_force_n = 0.0;  ///< estimated: what the voltage is to take away of the force on the cart
};

}  // namespace upright
