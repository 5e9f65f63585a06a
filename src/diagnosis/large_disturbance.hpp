// A random disturbance beside a fitted model that is larger than forces of the rig usually are. Any force
// that the model lacks can be taken for such a disturbance, so the model does not explain the data then.
#pragma once

#include "candidates.hpp"
#include "residual_tests.hpp"

namespace upright {

/// Whether tests that pass do so only beside a coloured force or torque in `noise` that is larger than
/// usual_force_n() or usual_torque_nm(). `tests` becomes structured and says so then.
bool find_large_disturbance(const Noise& noise, const DataRange& range, const PriorPolicy& prior,
                            ResidualTests& tests);

}  // namespace upright
