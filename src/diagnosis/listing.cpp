#include "listing.hpp"

#include <algorithm>

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

/// The effects among those from `first` on without which the error is lowest, if it is lower than with it.
std::optional<std::size_t> raising_effect(const HeldOutError& error, const std::vector<std::size_t>& effects,
                                          std::vector<std::size_t> suspects, double with_all) {
  std::optional<std::size_t> raises;
  for (const std::size_t suspect : suspects) {
    std::vector<std::size_t> others = effects;
    std::erase(others, suspect);
    const double without = error.of(others, true);
    if (!(without < with_all)) continue;
    with_all = without;
    raises = suspect;
  }
  return raises;
}

}  // namespace

Listing list_effects(Search& search, const Hypothesis& judged, const std::vector<std::size_t>& effects) {
  const HeldOutError error(search, judged);
  Listing listing;
  listing.before = listing.after = error.of({}, false);
  if (effects.empty()) listing.numbers_moved = error.of({}, true);
  std::vector<std::size_t> added, raised;
  for (const std::size_t effect : effects) {
    added.push_back(effect);
    const double now = error.of(added, added.size() == effects.size());
    const double before = listing.after;
    if (now > before) raised.push_back(effect);
    listing.after = std::min(now, before);
    listing.rows.push_back({effect, before, listing.after});
    if (added.size() < effects.size() || raised.empty()) continue;
    listing.raises = raising_effect(error, effects, raised, now);
    if (!listing.raises && now > before) listing.raises = raised.back();
  }
  return listing;
}

}  // namespace upright
