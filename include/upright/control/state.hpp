// The state on which the controller acts, in SI units.
#pragma once

namespace upright {

/// Measured positions and estimated velocities. theta is 0 upright and positive toward +x.
struct ControlState {
  double cart_m = 0.0;               ///< position of the cart [m]
  double theta_rad = 0.0;            ///< angle of the pendulum [rad]
  double cart_velocity_mps = 0.0;    ///< velocity of the cart [m/s]
  double pendulum_rate_radps = 0.0;  ///< rate of the pendulum [rad/s]
  // Known to a model-based estimator only.
  double motor_v = 0.0;       ///< motor voltage after the motor lag, where the plant file has one
  double cart_force_n = 0.0;  ///< estimated part of the force on the cart that the voltage is to cancel
};

}  // namespace upright
