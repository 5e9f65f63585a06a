// Where the fit of an effect begins, with what an earlier fit of the same data left.
#pragma once

#include <vector>

#include "candidates.hpp"

namespace upright {

/// Values of the effect's parameters to begin from, SI units. What is left of the cart's force at the fit
/// `point` of `data` points at the pitch of periodic forces.
std::vector<std::vector<double>> effect_starts(std::size_t effect, const DataRange& range,
                                               const FitData& data, const FitPoint& point,
                                               const SelectionPolicy& policy, const SearchBudget& budget);

}  // namespace upright
