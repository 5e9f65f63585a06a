#include "listing.hpp"

#include <algorithm>
#include <cmath>

#include "decision.hpp"

namespace upright {

namespace {

class HeldOutSimulation {
 public:
  HeldOutSimulation(Search& search, const Hypothesis& judged)
      : search_(search), judged_(judged), noise_(judged.train.point.noise) {}

  /// With these effects and the numbers of the plant file as given.
  FreeRunSimulation as_given(const std::vector<std::size_t>& effects) const { return of(effects, false); }
  /// The same with the numbers within what is believed of them.
  FreeRunSimulation settled(const std::vector<std::size_t>& effects) const { return of(effects, true); }
  /// The same with a number as given, of a model with fewer effects. Absent if it makes one of them
  /// impossible.
  std::optional<FreeRunSimulation> of_less(const std::vector<std::size_t>& effects,
                                           std::optional<std::size_t> as_given = {}) const {
    Hypothesis h = search_.fitted_separately(effects, judged_, &noise_, true, as_given);
    if (search_.bends_one_of(effects, judged_, h, &Search::is_admissible)) return std::nullopt;
    return search_.simulate(h);
  }

 private:
  FreeRunSimulation of(const std::vector<std::size_t>& effects, bool settled) const {
    Hypothesis h = search_.fitted_separately(effects, judged_, &noise_, settled);
    return search_.simulate(h);
  }

  Search& search_;
  const Hypothesis& judged_;
  const Noise noise_;
};

/// How far the error grew beyond what is not visible or may be chance [ln of a ratio].
double certain_rise(const FreeRunSimulation& before, const FreeRunSimulation& now,
                    const SelectionPolicy& policy) {
  const SimulationChange change = simulation_change(before.segment_gap, now.segment_gap);
  return change.mean - change.limit(policy);
}

std::vector<std::size_t> without(std::vector<std::size_t> effects, std::size_t gone) {
  std::erase(effects, gone);
  return effects;
}

/// The suspect without which the error is lowest, if it is lower by more than chance there.
/// `simulated_without(suspect)`: the simulation to compare, absent if that model cannot be.
template <class Simulate>
std::optional<std::size_t> raising(const std::vector<std::size_t>& suspects,
                                   const FreeRunSimulation& complete, const SelectionPolicy& policy,
                                   Simulate&& simulated_without) {
  std::optional<std::size_t> raises;
  double largest = 0.0;
  for (const std::size_t suspect : suspects) {
    const std::optional<FreeRunSimulation> simulated = simulated_without(suspect);
    const double rise = simulated ? certain_rise(*simulated, complete, policy) : 0.0;
    if (!(rise > largest)) continue;
    largest = rise;
    raises = suspect;
  }
  return raises;
}

bool is_in(const std::vector<std::size_t>& effects, std::size_t effect) {
  return std::find(effects.begin(), effects.end(), effect) != effects.end();
}

/// The numbers of the plant file that moved by more than a standard deviation of what is believed of them.
/// One that moved less stands for nothing else.
std::vector<std::size_t> moved_far(const Search& search, const Hypothesis& judged, const ListedModel& model) {
  std::vector<std::size_t> numbers;
  for (const FreeParameter& p : judged.free) {
    if (!search.can_hold(p.effect) || is_in(numbers, p.effect)) continue;
    const bool corrected = is_in(model.corrections, p.effect);
    if (is_in(model.effects, p.effect) && !corrected) continue;
    // Of a correction, the fit believed less.
    const double believed = p.prior_sigma / (corrected ? search.policy().correction.prior_widening : 1.0);
    const double moved = judged.train.point.plant.find(p.effect)->values[p.index] - p.prior_mean;
    if (believed > 0.0 && std::abs(moved) > believed) numbers.push_back(p.effect);
  }
  return numbers;
}

}  // namespace

double held_out_error(Search& search, const Hypothesis& judged, const std::vector<std::size_t>& effects) {
  return HeldOutSimulation(search, judged).settled(effects).gap;
}

Listing list_effects(Search& search, const Hypothesis& judged, const ListedModel& model) {
  const HeldOutSimulation simulation(search, judged);
  const FreeRunSimulation given = simulation.as_given({});
  FreeRunSimulation complete = given;
  Listing listing;
  listing.before = given.gap;
  if (model.effects.empty()) listing.numbers_moved = simulation.settled({}).gap;
  const std::vector<std::size_t> far = moved_far(search, judged, model);
  const auto is_as_believed = [&](std::size_t effect) {
    return is_in(model.corrections, effect) && search.can_hold(effect) && !is_in(far, effect);
  };
  std::vector<std::size_t> added, raised;
  double lowest = given.gap;
  for (const std::size_t effect : model.effects) {
    added.push_back(effect);
    const bool last = added.size() == model.effects.size();
    complete = last ? simulation.settled(added) : simulation.as_given(added);
    if (complete.gap > lowest && !is_as_believed(effect)) raised.push_back(effect);
    const double before = lowest;
    lowest = std::min(lowest, complete.gap);
    listing.rows.push_back({effect, before, lowest});
  }
  listing.after = complete.gap;
  // No step ends below the complete model.
  listing.before = std::max(listing.before, listing.after);
  for (Listing::Row& row : listing.rows) {
    row.before = std::max(row.before, listing.after);
    row.after = std::max(row.after, listing.after);
  }
  if (model.effects.empty()) return listing;
  const SelectionPolicy& policy = search.policy();
  listing.number_raises = raising(far, complete, policy, [&](std::size_t number) {
    return simulation.of_less(without(model.effects, number), number);
  });
  if (listing.number_raises || raised.empty()) return listing;
  listing.raises = raising(raised, complete, policy, [&](std::size_t effect) {
    return simulation.of_less(without(model.effects, effect));
  });
  if (!listing.raises && certain_rise(given, complete, policy) > 0.0) listing.raises = raised.back();
  return listing;
}

void scale_gaps(Diagnosis& diagnosis, double factor) {
  diagnosis.gap_before *= factor;
  for (FoundEffect& found : diagnosis.effects) {
    found.gap_before *= factor;
    found.gap_after *= factor;
  }
  for (CandidateScore& candidate : diagnosis.candidates) candidate.gap_after *= factor;
}

}  // namespace upright
