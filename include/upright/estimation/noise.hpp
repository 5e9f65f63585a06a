// Noise of a plant and its sensors, as modelled by the extended Kalman filter.
#pragma once

namespace upright {

/// Noise intensities; the quantisation belongs to each measurement. What is unmodelled has a white part and a
/// coloured part (first-order Gauss-Markov process).
struct Noise {
  double force = 0.0;               ///< white force on the cart [N sqrt(s)]
  double torque = 0.0;              ///< white torque on the pendulum [N m sqrt(s)]
  double coloured_force_n = 0.0;    ///< standard deviation of the coloured force on the cart
  double coloured_torque_nm = 0.0;  ///< standard deviation of the coloured torque on the pendulum
  double correlation_s = 0.1;       ///< correlation time of both
  double sensors = 1.0;   ///< sensor noise relative to that estimated from resolution and fourth differences
  double jitter_s = 0.0;  ///< standard deviation of the sampling time of the encoders
};

/// [s] The longest correlation time that is estimated. What lasts longer is a drift and no noise.
inline constexpr double longest_correlation_s = 3.0;

/// All forces and torques reduced to a tenth. High noise estimates and poor parameters support each
/// other: a second descent starts from low noise.
inline Noise reduced_process_noise(Noise noise) {
  noise.force *= 0.1;
  noise.torque *= 0.1;
  noise.coloured_force_n *= 0.1;
  noise.coloured_torque_nm *= 0.1;
  return noise;
}

/// The noise of the sensors alone, for a free-run simulation.
inline Noise sensors_only(Noise noise) {
  noise.force = noise.torque = noise.coloured_force_n = noise.coloured_torque_nm = 0.0;
  noise.sensors = 1.0;
  return noise;
}

}  // namespace upright
