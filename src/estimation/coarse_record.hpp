// A record with fewer samples, for a diagnosis of a record that is finer than the motion.
#pragma once

#include <vector>

#include "segments.hpp"
#include "upright/model/plant.hpp"

namespace upright {

struct Thinning {
  double period_s;       ///< from sample to sample, at most about [s]
  double largest_shift;  ///< by how much a mean voltage may move the cart [of the noise of its sensor]
};

/// Every few samples of each run. Between two of them the voltage is held at its mean. Samples are kept
/// wherever the voltage changes while the cart may stick, and wherever the mean would move the cart too far.
/// Gaps stay gaps.
std::vector<Measurement> coarse_runs(const std::vector<Measurement>& runs, const Plant& plant,
                                     const Thinning& thinning);

}  // namespace upright
