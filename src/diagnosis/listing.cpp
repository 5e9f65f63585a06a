#include "listing.hpp"

#include <algorithm>
#include <cmath>

namespace upright {

namespace {

class HeldOutError {
 public:
  HeldOutError(Search& search, const Hypothesis& judged)
      : search_(search), judged_(judged), noise_(judged.train.point.noise) {}

  /// With these effects; `settled`: the numbers of the plant file within what is believed of them.
  double of(const std::vector<std::size_t>& effects, bool settled) const {
    Hypothesis h = search_.fitted_separately(effects, judged_, &noise_, settled);
    search_.filter_held_out(h, sensors_only(noise_));
    return search_.gap_of(h);
  }

 private:
  Search& search_;
  const Hypothesis& judged_;
  const Noise noise_;
};

/// The suspect without which the error is lowest, if that is below `to_beat`.
std::optional<std::size_t> raising_effect(const HeldOutError& error, const std::vector<std::size_t>& effects,
                                          const std::vector<std::size_t>& suspects, double to_beat) {
  std::optional<std::size_t> raises;
  for (const std::size_t suspect : suspects) {
    std::vector<std::size_t> others = effects;
    std::erase(others, suspect);
    const double without = error.of(others, true);
    if (!(without < to_beat)) continue;
    to_beat = without;
    raises = suspect;
  }
  return raises;
}

}  // namespace

double held_out_error(Search& search, const Hypothesis& judged, const std::vector<std::size_t>& effects) {
  return HeldOutError(search, judged).of(effects, true);
}

Listing list_effects(Search& search, const Hypothesis& judged, const std::vector<std::size_t>& effects) {
  const HeldOutError error(search, judged);
  Listing listing;
  listing.before = listing.after = error.of({}, false);
  if (effects.empty()) listing.numbers_moved = error.of({}, true);
  std::vector<std::size_t> added, raised;
  double lowest = listing.before;
  for (const std::size_t effect : effects) {
    added.push_back(effect);
    listing.after = error.of(added, added.size() == effects.size());
    if (listing.after > lowest) raised.push_back(effect);
    const double before = lowest;
    lowest = std::min(lowest, listing.after);
    listing.rows.push_back({effect, before, lowest});
  }
  // No step ends below the complete model.
  for (Listing::Row& row : listing.rows) {
    row.before = std::max(row.before, listing.after);
    row.after = std::max(row.after, listing.after);
  }
  const bool worse = listing.after > listing.before;
  const double by_chance = std::exp(-search.policy().acceptance.worse_simulation_by_chance);
  if (!raised.empty())
    listing.raises = raising_effect(error, effects, raised, listing.after * (worse ? 1.0 : by_chance));
  if (!listing.raises && worse) listing.raises = raised.back();
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
