// The samples that a diagnosis works on: a part of them, where the record is finer than the motion.
#pragma once

#include <vector>

#include "search.hpp"

namespace upright {

/// The runs with fewer samples; empty where that would save too little, or leave too few.
std::vector<Measurement> thinned_runs(const std::vector<Measurement>& runs, const Plant& plant,
                                      const SearchBudget& budget);

/// A fit to `thinned` data made again with all samples of the same segments of `runs`. The fit itself where
/// that fails.
Hypothesis fitted_to_all_samples(const Hypothesis& h, const FitData& thinned,
                                 const std::vector<Measurement>& runs);

}  // namespace upright
