#include "coloured_null.hpp"

#include <algorithm>
#include <limits>

#include "without_effect.hpp"

namespace upright {

namespace {

FitOptions coloured() {
  FitOptions options;
  options.coloured_noise = true;
  return options;
}

class ColouredNull {
 public:
  ColouredNull(const Search& search, const Hypothesis& known)
      : search_(search), all_(search.all_data()), known_(known), with_(known) {
    with_.train = fit(all_, known.train.point, known.free, coloured());
  }

  /// What the effect saves beside such a disturbance, after the penalty of its parameters.
  double evidence_of(std::size_t effect) const {
    const FitPoint& with = with_.train.point;
    if (!is_removable(with.plant, effect, search_.given())) return std::numeric_limits<double>::infinity();
    const FitResult without = fit_without(all_, with, effect, known_.free, search_.given(), coloured());
    return without.objective - with_.train.objective - search_.penalty_of(known_, effect);
  }

  double certainty_of(std::size_t effect) const { return search_.certainty(with_, effect); }

 private:
  const Search& search_;
  FitData all_;
  const Hypothesis& known_;
  Hypothesis with_;
};

}  // namespace

std::optional<std::size_t> outdone_by_coloured_noise(const Search& search, const Hypothesis& known,
                                                     const std::vector<Reproduction>& effects) {
  const AcceptancePolicy& policy = search.policy().acceptance;
  const double certain_z = search.policy().significance.certain_z;
  std::optional<ColouredNull> null;
  std::optional<std::size_t> worst;
  double least = std::numeric_limits<double>::infinity();
  if (!search.is_of_all_data(known.train.point)) return worst;
  for (const Reproduction& found : effects) {
    // An attached mass colours a white force by its resonance, so no evidence against white ones speaks for
    // it.
    const bool overwhelming =
        white_evidence(found) > policy.overwhelming_evidence && !attaches_mass(found.effect);
    if (search.is_plant_number(found.effect) || overwhelming) continue;
    if (!null) null.emplace(search, known);
    const double evidence = null->evidence_of(found.effect);
    const bool holds = evidence > policy.min_evidence && null->certainty_of(found.effect) > certain_z;
    if (holds || !(evidence < least)) continue;
    least = evidence;
    worst = found.effect;
  }
  return worst;
}

}  // namespace upright
