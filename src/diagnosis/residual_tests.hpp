// Is what is left noise, or something that is not in the model? Noise that no model needs to explain is the
// same all along and goes with nothing. The tests are on the innovations of the filter, which are white under
// the right model in open and in closed loop alike (a residual force is not: the loop answers it, so that it
// goes with the voltage whatever it is):
// - dispersion: the whitened innovations of short blocks are as large everywhere as chance allows;
// - tails: short pulses of force or torque, fitted block by block, have no heavier tails than a Gaussian;
// - colour: over a tenth of a second and more force and torque are not much larger than as white noise, nor
//   much smaller;
// - dependence: forces that no effect of the registry has (that drift with time, friction that changes with
//   time, what fades after a reversal) do not show, nor do shifts of what the sensors show that go with the
//   voltage or the direction (a drive that gives way or has play between the encoder and what it measures).
#pragma once

#include <string>
#include <vector>

#include "estimation/fit.hpp"
#include "selection_policy.hpp"
#include "tails.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

struct ResidualTests {
  double noise_ratio = 1.0;  ///< rms of a plain simulation's residual over the sensors' noise
  double excess = 1.0;       ///< the same over what noise like what is left makes of it at most
  double dispersion = 1.0;   ///< 95th percentile of block rms over its median
  Tails tails;               ///< of the pulses
  double certainty = 0.0;    ///< of the dependence that shows most [standard errors]
  std::string depends_on;    ///< what with, and where: in which equation or sensor
  /// How much larger slow force and torque are, a few hertz and below, than white noise that accounts for the
  /// samples: a disturbance whose colour the filter does not know is estimated where the samples show it
  /// best, and a plain simulation is moved by what is slow. At least 1.
  double slow_force = 1.0, slow_torque = 1.0;
  double quick = 1.0;           ///< the smaller of both, where they are smaller than such noise
  bool beyond_sensors = false;  ///< it is more than the sensors' own noise
  bool structured = false;      ///< and more than a disturbance: something is missing
  std::string sentence;
};

/// White noise that moves a plain simulation as what is left does.
Noise low_frequency_equivalent(Noise noise, const ResidualTests& tests);

/// Examines what a fit leaves at `point`.
ResidualTests examine_residuals(const FitData& data, const FitPoint& point, const SelectionPolicy& policy);

}  // namespace upright
