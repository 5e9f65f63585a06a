// A random force or torque beside a fitted model that is no usual disturbance: it is as large as the forces
// that effects have, or it drifts. Any force that the model lacks can be taken for such a disturbance, so the
// model does not explain the data then.
#pragma once

#include "candidates.hpp"
#include "residual_tests.hpp"

namespace upright {

/// Whether tests that pass beside `noise` do so beside a coloured force or torque that is larger than
/// usual_force_n() or usual_torque_nm(), or lasts for longest_correlation_s. `tests` becomes structured and
/// says so then.
bool find_unusual_disturbance(const Noise& noise, const DataRange& range, const PriorPolicy& prior,
                              ResidualTests& tests);

}  // namespace upright
