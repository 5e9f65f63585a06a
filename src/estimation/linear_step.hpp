// One sample of a segment, linearised along the trajectory of the extended Kalman filter.
#pragma once

namespace upright {

/// State order: x, theta, v, omega, bristle, then position and velocity of an attached mass. Of states that a
/// plant does not have all is zero. Channels: cart, pendulum. The filter also estimates two disturbances, a
/// coloured force and a coloured torque, which come after the states in `update`.
struct LinearStep {
  static constexpr int states = 7;        ///< the number of states
  static constexpr int rigid_states = 5;  ///< of a plant without an attached mass
  static constexpr int disturbances = 2;  ///< the number of disturbances
  double transition[states][states];  ///< from the previous sample, after its update; identity at the first
  double by_force[2];                 ///< accelerations of cart and pendulum per unit of force on the cart
  double by_torque[2];                ///< the same per unit of torque on the pendulum
  double residual[2];                 ///< measured minus predicted from the previous samples
  double innovation[2];               ///< the same, predicted from the sample's earlier channel as well
  /// Kalman gain of each channel for states and disturbances, applied in sequence.
  double update[2][states + disturbances];
  /// Of the state after the sample: by the gains and innovations of both channels, and by the velocity that
  /// the estimated disturbances give until the next sample.
  double correction[states];
  /// Change of the velocities of cart and pendulum [second index] over the period that ends here, per unit of
  /// the disturbing force and torque [first index]; 0 where friction holds both.
  double impulse[disturbances][2];
  double keeps;        ///< share of a disturbance that remains after the period
  double variance[2];  ///< of each innovation
  double weight[2];    ///< weight of each measurement (see Measurement::cart_weight)
  double gain[2];      ///< derivative of the sensor's output with respect to its coordinate
  double rate[2];      ///< velocities, for jitter
  double holds[2];     ///< dry friction [N, N m] that holds cart and pendulum at the end; 0: they move
  double period_s;     ///< from the previous sample [s]
};

}  // namespace upright
