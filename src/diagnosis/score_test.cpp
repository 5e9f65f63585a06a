#include "score_test.hpp"

#include <algorithm>

#include "effect_starts.hpp"

namespace upright {

namespace {

/// The objective after a step, were residuals linear. A step that is cut short may promise to be worse.
double promised_objective(const FitData& data, const FitPoint& point,
                          const std::vector<FreeParameter>& free) {
  FitOptions only_look;
  only_look.most_iterations = 0;
  only_look.noise_rounds = 0;
  const FitResult seen = fit(data, point, free, only_look);
  return seen.objective - std::max(0.0, seen.bounded_fall);
}

/// A parameter at an end of its range cannot follow, and a step that it would make says nothing.
std::vector<FreeParameter> within_range(std::vector<FreeParameter> free, const Plant& plant) {
  std::erase_if(free, [&](const FreeParameter& p) {
    const double value = plant.find(p.effect)->values[p.index];
    return value <= p.low || value >= p.high;
  });
  return free;
}

}  // namespace

PromisedEffect most_promising_effect(const FitData& data, const FitResult& fitted,
                                     const std::vector<FreeParameter>& fitted_free, const Search& search,
                                     const std::vector<std::string_view>& tried_already) {
  PromisedEffect best;
  const DataRange& range = search.range();
  const std::vector<FreeParameter> free = within_range(fitted_free, fitted.point.plant);
  const double without = promised_objective(data, fitted.point, free);
  for (const std::size_t effect : candidate_effects(fitted.point.plant, range)) {
    if (std::find(tried_already.begin(), tried_already.end(), effect_registry()[effect].kind) !=
        tried_already.end())
      continue;
    std::vector<FreeParameter> with = free;
    for (const FreeParameter& p : free_parameters(effect, range, search.policy().prior)) with.push_back(p);
    for (const std::vector<double>& values :
         effect_starts(effect, range, data, fitted.point, search.policy(), search.budget())) {
      FitPoint point = fitted.point;
      point.plant.set(effect, values);
      follow_sensors(point.starts, fitted.point.plant, point.plant);
      const double fall = without - promised_objective(data, point, with);
      if (fall > best.fall) best = {effect, fall};
    }
  }
  return best;
}

}  // namespace upright
