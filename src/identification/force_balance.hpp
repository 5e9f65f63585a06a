// The classical inverse-dynamics regression: the motor force against the motion, sample by sample. Velocity
// and acceleration come from a zero-phase filter, which is applied to every term.
#pragma once

#include <optional>
#include <vector>

#include "upright/measurement/measurement.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// A run as forces: the forces of motor and pendulum on the cart, and its motion.
struct ForceTrace {
  std::vector<double> time_s, cart_mps, cart_mps2;
  std::vector<double> force_n;  ///< motor at standstill (force per volt times voltage) and pendulum reaction
  std::vector<double> friction_n;  ///< force that slows the cart, without inertia and back-EMF
};
ForceTrace force_trace(const Measurement& run, const Plant& plant);

/// force = mass a + damping v + coulomb sgn(v) - constant. Errors are robust standard deviations.
struct ForceBalance {
  double mass_kg = 0.0, damping_n_per_mps = 0.0, coulomb_n = 0.0, constant_n = 0.0;
  double mass_sigma = 0.0, damping_sigma = 0.0, coulomb_sigma = 0.0, constant_sigma = 0.0;
  double relative_error = 0.0;  ///< norm of the residual divided by the norm of the force
  std::size_t rows = 0;
};
/// Empty if no run moves the cart enough.
std::optional<ForceBalance> balance_forces(const std::vector<Measurement>& runs, const Plant& plant);

/// A breakaway: the voltage increased slowly from rest, as one ramp, until the cart moved.
struct Breakaway {
  std::size_t run = 0;
  double time_s = 0.0;
  double force_n = 0.0;  ///< signed, including the reaction of the pendulum
};
std::vector<Breakaway> find_breakaways(const std::vector<Measurement>& runs, const Plant& plant);

/// A stretch of constant voltage with constant speed, apart from sensor noise.
struct SteadyPoint {
  std::size_t run = 0;
  double cart_mps = 0.0;
  double friction_n = 0.0;  ///< without back-EMF; positive if it acts against motion toward +x
};
std::vector<SteadyPoint> find_steady_points(const std::vector<Measurement>& runs, const Plant& plant);

}  // namespace upright
