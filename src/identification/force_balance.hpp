// The motor's force against what moves, sample by sample: the classical inverse-dynamics regression. Velocity
// and acceleration come from a zero-phase filter that every term passes alike.
#pragma once

#include <optional>
#include <vector>

#include "upright/measurement/measurement.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// A run as forces: what the motor and the pendulum do to the cart, and how it moves.
struct ForceTrace {
  std::vector<double> time_s, cart_mps, cart_mps2;
  std::vector<double> force_n;  ///< motor at standstill (force per volt times voltage) and pendulum reaction
  std::vector<double> friction_n;  ///< what slows the cart beyond its inertia, back-EMF taken out
};
ForceTrace force_trace(const Measurement& run, const Plant& plant);

/// force = mass a + damping v + coulomb sgn(v) - constant. Errors are robust standard deviations.
struct ForceBalance {
  double mass_kg = 0.0, damping_n_per_mps = 0.0, coulomb_n = 0.0, constant_n = 0.0;
  double mass_sigma = 0.0, damping_sigma = 0.0, coulomb_sigma = 0.0, constant_sigma = 0.0;
  double relative_error = 0.0;  ///< norm of what is left over norm of the force
  std::size_t rows = 0;
};
/// None where no run moves the cart enough.
std::optional<ForceBalance> balance_forces(const std::vector<Measurement>& runs, const Plant& plant);

/// The voltage grew slowly from rest, as one ramp, until the cart went under that same ramp.
struct Breakaway {
  std::size_t run = 0;
  double time_s = 0.0;
  double force_n = 0.0;  ///< signed, pendulum reaction included
};
std::vector<Breakaway> find_breakaways(const std::vector<Measurement>& runs, const Plant& plant);

/// A stretch of constant voltage along which the speed stays the same, but for what the sensor's noise makes
/// of it.
struct SteadyPoint {
  std::size_t run = 0;
  double cart_mps = 0.0;
  double friction_n = 0.0;  ///< what friction takes, back-EMF taken out; positive against motion toward +x
};
std::vector<SteadyPoint> find_steady_points(const std::vector<Measurement>& runs, const Plant& plant);

}  // namespace upright
