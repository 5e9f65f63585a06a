// In which equation a residual is and what it goes with, for the sentence beside an effect.
#pragma once

#include <string>

#include "estimation/fit.hpp"
#include "selection_policy.hpp"

namespace upright {

/// In which equation the residual is and what it goes with most: a ridge regression of the smoothed residual
/// force and torque on velocity, direction, position, voltage, time, ..., judged on segments it has not seen.
struct ResidualLocation {
  bool in_pendulum = false;
  double share = 0.0;      ///< of its variance that can be predicted
  std::string depends_on;  ///< empty: on nothing that was measured
};
ResidualLocation locate_residual(const FitData& data, const FitPoint& point, const SelectionPolicy& policy);

}  // namespace upright
