#include "place_null.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "estimation/random_curve.hpp"
#include "listing.hpp"
#include "without_effect.hpp"

namespace upright {

namespace {

/// Nodes over the whole travel.
CurveNodes nodes_over(const std::vector<CurveArgument>& places, std::size_t count) {
  double low_m = std::numeric_limits<double>::infinity(), high_m = -low_m;
  for (const CurveArgument& segment : places)
    for (const double place_m : segment.at) {
      low_m = std::min(low_m, place_m);
      high_m = std::max(high_m, place_m);
    }
  if (!(high_m > low_m)) return {};
  return {low_m, (high_m - low_m) / static_cast<double>(count - 1), count};
}

class PlaceNull {
 public:
  PlaceNull(const Search& search, const Hypothesis& known)
      : search_(search),
        known_(known),
        all_(search.all_data()),
        places_(shown_places(all_)),
        nodes_(nodes_over(places_, search.budget().track_nodes)) {
    if (nodes_.count > 0) track_.emplace(equations_at(known.train.point), nodes_);
  }

  /// Null if there is none.
  const RandomCurve* track_force() const { return track_ && track_->is_there() ? &*track_ : nullptr; }

  /// What the effect saves beside the force, after the penalty of its parameters.
  double evidence_of(std::size_t effect) const {
    const FitPoint& with = known_.train.point;
    if (!is_removable(with.plant, effect, search_.given())) return std::numeric_limits<double>::infinity();
    FitOptions same_noise;
    same_noise.noise_rounds = 0;
    const FitResult without = fit_without(all_, with, effect, known_.free, search_.given(), same_noise);
    if (!std::isfinite(without.objective)) return std::numeric_limits<double>::infinity();
    return without.objective + track_->change_at(equations_at(without.point)) - known_.train.objective -
           track_->change() - search_.penalty_of(known_, effect);
  }

 private:
  CurveEquations equations_at(const FitPoint& point) const {
    return curve_equations(linearise(all_, point), nodes_, places_);
  }

  const Search& search_;
  const Hypothesis& known_;
  FitData all_;
  std::vector<CurveArgument> places_;
  CurveNodes nodes_;
  std::optional<RandomCurve> track_;
};

/// Whether a simulation of held-out data without the effect is far worse.
bool is_needed(Search& search, const Hypothesis& judged, const std::vector<Reproduction>& effects,
               std::size_t effect) {
  std::vector<std::size_t> all, others;
  for (const Reproduction& other : effects) {
    all.push_back(other.effect);
    if (other.effect != effect) others.push_back(other.effect);
  }
  return held_out_error(search, judged, others) >
         search.policy().power.clear_gap * held_out_error(search, judged, all);
}

}  // namespace

std::optional<std::size_t> outdone_by_place(Search& search, const Hypothesis& known, const Hypothesis& judged,
                                            const std::vector<Reproduction>& effects) {
  std::optional<std::size_t> worst;
  if (known.train.point.starts.size() != search.all_data().segments.size()) return worst;
  std::optional<PlaceNull> null;
  double least = search.policy().acceptance.min_evidence;
  for (const Reproduction& found : effects) {
    if (search.is_nuisance(found.effect)) continue;
    if (!null) null.emplace(search, known);
    if (null->track_force() == nullptr) break;
    const double evidence = null->evidence_of(found.effect);
    if (!(evidence < least) || is_needed(search, judged, effects, found.effect)) continue;
    least = evidence;
    worst = found.effect;
  }
  return worst;
}

std::optional<std::string> place_force_left(const Search& search, const Hypothesis& known) {
  if (known.train.point.starts.size() != search.all_data().segments.size()) return std::nullopt;
  const PlaceNull null(search, known);
  const RandomCurve* track = null.track_force();
  if (track == nullptr || !(-track->change() > search.policy().acceptance.min_evidence)) return std::nullopt;
  constexpr double mm_per_m = 1000.0;
  std::ostringstream text;
  text.precision(2);
  text << "the residual depends on the place: a random force of the track, with a standard deviation of "
       << track->deviation() << " N and a correlation length of " << mm_per_m * track->length()
       << " mm, accounts for a part of it";
  return text.str();
}

}  // namespace upright
