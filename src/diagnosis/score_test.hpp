// Whether an effect that a fitted model lacks would make it better, told by the derivatives at the fit.
#pragma once

#include <string_view>
#include <vector>

#include "search.hpp"

namespace upright {

/// The effect of the registry that promises most, and by how much minus twice the log likelihood would fall
/// with it.
struct ScoreTestResult {
  std::size_t effect = 0;
  double fall = 0.0;
};

/// `fitted` is the fit of `data` in which `free` moved; of `search` the range of the runs is used, its policy
/// and its budget. Effects in its plant are not tried, nor those `tried_already`. Where a step must be cut
/// short, what it promises is what the shorter step promises.
ScoreTestResult best_by_score_test(const FitData& data, const FitResult& fitted,
                                   const std::vector<FreeParameter>& free, const Search& search,
                                   const std::vector<std::string_view>& tried_already);

}  // namespace upright
