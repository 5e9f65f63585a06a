// What is left over, as a force on the cart and a torque on the pendulum: estimated by a Kalman smoother
// along the simulated trajectory, with the force and the torque as extra states that wander.
#pragma once

#include <vector>

#include "selection_policy.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// One trace per segment, in the order of the segments.
std::vector<ResidualTrace> smooth_residuals(const FitData& data, const FitPoint& point,
                                            const LocationPolicy& policy);

}  // namespace upright
