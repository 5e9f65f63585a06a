// A record with fewer samples, for a diagnosis of a record that is finer than the motion.
#pragma once

#include <vector>

#include "upright/measurement/measurement.hpp"
#include "upright/model/plant.hpp"

namespace upright {

struct Thinning {
  double period_s;       ///< from sample to sample, at most about [s]
  double largest_shift;  ///< by how much a mean voltage may move the cart [of the noise of its sensor]
};

/// Samples of each run that are at most about `period_s` apart. Their voltages are `commands`: several
/// in a row become one with their mean. All stay where the cart may stick, or the mean would move it too far.
/// `voltage_v` is the mean from each sample to the next. Gaps stay gaps.
std::vector<Measurement> coarse_runs(const std::vector<Measurement>& runs, const Plant& plant,
                                     const Thinning& thinning);

}  // namespace upright
