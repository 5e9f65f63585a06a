#include "score_test.hpp"

#include <algorithm>

#include "effect_starts.hpp"

namespace upright {

namespace {

/// A parameter at an end of its range cannot follow, and a step that it would make says nothing.
std::vector<FreeParameter> within_range(std::vector<FreeParameter> free, const Plant& plant) {
  std::erase_if(free, [&](const FreeParameter& p) {
    const double value = plant.find(p.effect)->values[p.index];
    return value <= p.low || value >= p.high;
  });
  return free;
}

}  // namespace

ScoreTestResult best_by_score_test(const FitData& data, const FitResult& fitted,
                                   const std::vector<FreeParameter>& fitted_free, const Search& search,
                                   const std::vector<std::string_view>& tried_already) {
  ScoreTestResult best;
  const DataRange& range = search.range();
  const std::vector<FreeParameter> free = within_range(fitted_free, fitted.point.plant);
  const double without = objective_after_step(data, fitted.point, free);
  for (const std::size_t effect : candidate_effects(fitted.point.plant, range)) {
    if (std::find(tried_already.begin(), tried_already.end(), effect_registry()[effect].kind) !=
        tried_already.end())
      continue;
    std::vector<FreeParameter> with = free;
    for (const FreeParameter& p : free_parameters(effect, range, search.policy().prior)) with.push_back(p);
    for (const std::vector<double>& values :
         EffectStarts(search.policy(), search.budget()).of(effect, range, data, fitted.point)) {
      FitPoint point = fitted.point;
      point.plant.set(effect, values);
      convert_initial_states(point.starts, fitted.point.plant, point.plant);
      const double fall = without - objective_after_step(data, point, with);
      if (fall > best.fall) best = {effect, fall};
    }
  }
  return best;
}

}  // namespace upright
