// The starts of the fit of an effect, from the residual of an earlier fit of the same data.
#pragma once

#include <vector>

#include "candidates.hpp"

namespace upright {

/// Starting values of the parameters of an effect, in SI units. The residual force at the fit `point` of
/// `data` shows the pitch of periodic forces.
std::vector<std::vector<double>> effect_starts(std::size_t effect, const DataRange& range,
                                               const FitData& data, const FitPoint& point,
                                               const SelectionPolicy& policy, const SearchBudget& budget);

}  // namespace upright
