// The quick diagnosis: one search on thinned data, of which only what is beyond doubt is named.
#pragma once

#include <string>
#include <vector>

#include "search_budget.hpp"

namespace upright {

/// One candidate is fitted completely in each round, and each fit is made once.
inline SearchBudget quick_budget() {
  SearchBudget budget;
  budget.min_screening_segments = budget.quick_screening_segments;
  budget.max_screening_stride *= 2;
  budget.min_screened /= 2;
  budget.max_finalists = 1;
  budget.max_refits = 1;
  budget.clear_evidence = 0.0;
  return budget;
}

/// What it leaves out, in words.
inline std::vector<std::string> not_examined_quickly() {
  return {"samples less than 10 ms apart",
          "effects that are not beyond doubt",
          "pairs of effects that hide each other",
          "effects that these data do not distinguish",
          "other held-out runs",
          "curves of what is left"};
}

}  // namespace upright
