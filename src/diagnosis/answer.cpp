// The words of a diagnosis, and what of its trials stands beside an effect.
#include <algorithm>

#include "search_budget.hpp"
#include "selection_policy.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

std::string kind_of(std::size_t effect) {
  return std::string(effect_registry()[effect].kind);
}

std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::explained:
      return "explained";
    case Verdict::no_discrepancy:
      return "no_discrepancy";
    case Verdict::unexplained:
      return "unexplained";
    case Verdict::not_excited:
      return "not_excited";
    case Verdict::described:
      return "described";
  }
  return "";
}

double share_of(const RunEvidence& run, const std::vector<RunEvidence>& all) {
  double sum = 0.0;
  for (const RunEvidence& of : all) sum += std::max(of.evidence, 0.0);
  return sum > 0.0 ? std::max(run.evidence, 0.0) / sum : 0.0;
}

NextBest next_best(const Diagnosis& diagnosis, const FoundEffect& effect) {
  const double near = SearchBudget{}.resembling_share;
  const std::size_t max_others = SearchBudget{}.max_next_best;
  NextBest best;
  for (const Trial& trial : diagnosis.trials)
    if (trial.taken && trial.effect == effect.effect) best.taken = &trial;
  if (best.taken == nullptr) return best;
  for (const Trial& trial : diagnosis.trials) {
    const std::vector<std::size_t>& same = effect.indistinguishable_from;
    const double share = trial.evidence / best.taken->evidence;
    if (trial.round == best.taken->round && share > near && share < 1.0 &&
        std::find(same.begin(), same.end(), trial.effect) == same.end())
      best.others.push_back(&trial);
  }
  std::stable_sort(best.others.begin(), best.others.end(),
                   [](const Trial* a, const Trial* b) { return a->evidence > b->evidence; });
  if (best.others.size() > max_others) best.others.resize(max_others);
  return best;
}

}  // namespace upright
