// A sample of a segment, linearised along the trajectory that the extended Kalman filter estimates.
#pragma once

namespace upright {

/// State order: x, theta, v, omega, bristle. Channels: cart, pendulum.
struct LinearStep {
  static constexpr int states = 5;
  double transition[states][states];  ///< from the sample before, after its update; identity at the first
  double by_force[2], by_torque[2];   ///< accelerations of cart and pendulum per unit force and torque
  double residual[2];                 ///< measured minus predicted from the samples before
  double innovation[2];               ///< the same, but predicted from the sample's earlier channel as well
  double update[2][states];           ///< Kalman gain of each channel, taken in turn
  double correction[states];          ///< of the state, by the gains and innovations of both channels
  double variance[2];                 ///< of each innovation
  double weight[2];                   ///< how much of a measurement each is
  double gain[2];                     ///< d output / d state of the sensors
  double rate[2];                     ///< velocities, for jitter
  double holds[2];  ///< level [N, N m] at which cart and pendulum rest in the end; 0: they move
  double period_s;
};

}  // namespace upright
