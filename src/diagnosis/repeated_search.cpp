#include "repeated_search.hpp"

#include <algorithm>

namespace upright {

bool may_find_more_with_other_runs(const Diagnosis& first, const DataSplit& data,
                                   const SelectionPolicy& policy) {
  // What held-out runs say against it may be chance, or another effect.
  const auto enough = [&](const Trial& trial) {
    return trial.evidence + std::max(trial.held, 0.0) >= policy.acceptance.min_evidence;
  };
  return largest_voltage_is_held_out(data) || std::ranges::any_of(first.trials, enough);
}

bool is_better_answer(double saved, bool explains, bool first_is_unexplained,
                      const AcceptancePolicy& policy) {
  if (explains) return saved > -policy.min_evidence;
  return first_is_unexplained && saved > policy.overwhelming_evidence;
}

}  // namespace upright
