// A record with fewer samples, for a diagnosis of a record that is finer than the motion.
#pragma once

#include <vector>

#include "segments.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// Every few samples of each run, at most about `period_s` apart. Between two of them the voltage is held at
/// its mean. Samples are kept wherever the voltage changes while the cart may stick, and wherever the mean
/// would move the cart by more than a hundredth of the sensor's noise. Gaps stay gaps.
std::vector<Measurement> coarse_runs(const std::vector<Measurement>& runs, const Plant& plant,
                                     double period_s);

}  // namespace upright
