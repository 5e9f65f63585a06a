// The noise of a plant and its sensors, as the extended Kalman filter assumes it.
#pragma once

namespace upright {

/// Intensities of the noise; quantisation comes with each measurement.
struct Noise {
  double force = 0.0;     ///< white force on the cart [N sqrt(s)]
  double torque = 0.0;    ///< white torque on the pendulum [N m sqrt(s)]
  double sensors = 1.0;   ///< sensor noise over what the steps and fourth differences of the data show
  double jitter_s = 0.0;  ///< standard deviation of the time at which encoders are read
};

/// A tenth of the force and torque noise. Much noise and a poor fit hold each other up: a second descent
/// begins with little noise.
inline Noise reduced_process_noise(Noise noise) {
  noise.force *= 0.1;
  noise.torque *= 0.1;
  return noise;
}

/// That of the sensors alone, for a plain simulation.
inline Noise sensors_only(Noise noise) {
  noise.force = noise.torque = 0.0;
  noise.sensors = 1.0;
  return noise;
}

}  // namespace upright
