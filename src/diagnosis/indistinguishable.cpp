#include "indistinguishable.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace upright {

namespace {

/// Place of the size of an effect among the free parameters; -1 where it has none.
Eigen::Index size_place(const Hypothesis& h, std::size_t effect) {
  for (std::size_t j = 0; j < h.free.size(); ++j)
    if (h.free[j].effect == effect && h.free[j].index == 0) return static_cast<Eigen::Index>(j);
  return -1;
}

double value_of(const Hypothesis& h, Eigen::Index place) {
  const FreeParameter& p = h.free[static_cast<std::size_t>(place)];
  return h.train.point.plant.find(p.effect)->values[p.index];
}

/// What the size of an effect is when there is nothing to find.
double absent_value(const Hypothesis& h, Eigen::Index place) {
  const FreeParameter& p = h.free[static_cast<std::size_t>(place)];
  return p.prior_sigma > 0.0 ? p.prior_mean : effect_registry()[p.effect].parameters[p.index].neutral;
}

double distance(const Hypothesis& h, Eigen::Index place) {
  const double off = std::abs(value_of(h, place) - absent_value(h, place));
  const double sigma = std::sqrt(std::max(h.train.covariance(place, place), 0.0));
  return sigma > 0.0 ? off / sigma : std::numeric_limits<double>::infinity();
}

/// The plant when the data are explained without the effect at `place`: the others follow as far as they go
/// together with it.
Plant without(const Hypothesis& h, Eigen::Index place) {
  Plant plant = h.train.point.plant;
  const double moved = absent_value(h, place) - value_of(h, place);
  const double variance = h.train.covariance(place, place);
  for (std::size_t j = 0; j < h.free.size(); ++j) {
    const FreeParameter& p = h.free[j];
    const ParameterInfo& info = effect_registry()[p.effect].parameters[p.index];
    auto values = plant.find(p.effect)->values;
    const double share = h.train.covariance(static_cast<Eigen::Index>(j), place) / variance;
    values[p.index] = std::clamp(values[p.index] + moved * share, info.range.low, info.range.high);
    plant.set(p.effect, values);
  }
  return plant;
}

bool grows_from_nothing(std::size_t effect) {
  return std::isfinite(effect_registry()[effect].parameters[0].neutral);
}

}  // namespace

bool reduces_certainty(double distance_with_other, double distance_alone, const SignificancePolicy& policy) {
  return distance_with_other < policy.certain_z && distance_with_other < distance_alone - distance_with_other;
}

bool is_indistinguishable(double evidence_lost, double t_value, const SelectionPolicy& policy) {
  return evidence_lost < evidence_at(policy.significance.certain_z) ||
         (evidence_lost < policy.acceptance.overwhelming_evidence &&
          t_value < policy.significance.interval_z);
}

std::vector<FreedEffect> freed_effects(const Search& search, const Hypothesis& h,
                                       const std::vector<std::size_t>& listed) {
  std::vector<std::size_t> effects = candidate_effects(h.train.point.plant, search.range());
  effects.insert(effects.end(), search.nuisances().begin(), search.nuisances().end());
  std::vector<FreedEffect> freed;
  for (const std::size_t effect : effects) {
    if (!grows_from_nothing(effect)) continue;
    if (std::find(listed.begin(), listed.end(), effect) != listed.end()) continue;
    Hypothesis with = search.with_effect_free(h, effect);
    if (with.valid) freed.push_back({effect, std::move(with)});
  }
  return freed;
}

std::optional<Plant> fitted_alternative(Search& search, const Hypothesis& current, const Hypothesis& without,
                                        std::size_t effect, double objective_on_subset) {
  const SelectionPolicy& policy = search.policy();
  Hypothesis alternative = search.screened(without, effect);
  search.converge_on_subset(alternative);
  // So much worse on a part, it is no better on the whole.
  if (!(alternative.train.objective - objective_on_subset < policy.acceptance.overwhelming_evidence))
    return std::nullopt;
  alternative.train.point.noise = current.train.point.noise;
  search.refit(without, alternative);
  const Improvement worse = compare(alternative, current);
  if (!search.is_plausible(alternative, effect) || !is_indistinguishable(worse.train, worse.t_value, policy))
    return std::nullopt;
  return alternative.train.point.plant;
}

std::vector<Alternative> linear_alternatives(const Search& search, const Hypothesis& h,
                                             const std::vector<std::size_t>& listed,
                                             const std::vector<FreedEffect>& freed) {
  std::vector<Alternative> alternatives;
  for (const auto& [other, fit] : freed) {
    if (is_periodic(other)) continue;  // another effect with every pitch, which would have to be known
    for (const std::size_t effect : listed) {
      const Eigen::Index before = size_place(h, effect), after = size_place(fit, effect);
      if (before < 0 || after < 0 || !std::isfinite(absent_value(h, before))) continue;
      const double doubt = distance(fit, after);
      if (reduces_certainty(doubt, distance(h, before), search.policy().significance))
        alternatives.push_back({effect, other, without(fit, after)});
    }
  }
  return alternatives;
}

}  // namespace upright
