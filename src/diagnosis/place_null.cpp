#include "place_null.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "candidates.hpp"
#include "estimation/random_curve.hpp"
#include "listing.hpp"
#include "tails.hpp"
#include "upright/model/effects/all.hpp"
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

/// The force of an effect at the nodes [N]; absent if the place alone does not determine it.
std::optional<Eigen::VectorXd> force_of_place(const PlantEffect& effect, const CurveNodes& nodes) {
  std::optional<Eigen::VectorXd> force_n;
  const double* p = effect.values.data();
  for_each_effect([&]<std::size_t I>() {
    using E = EffectAt<I>;
    if constexpr (requires { E::cart_force(p, 0.0, 0.0); }) {
      if (I != effect.number) return;
      force_n.emplace(nodes.count);
      for (std::size_t node = 0; node < nodes.count; ++node) {
        const double place_m = nodes.first + nodes.spacing * static_cast<double>(node);
        const double at_rest_n = E::cart_force(p, place_m, 0.0);
        constexpr double any_speed_mps = 1.0;
        if (E::cart_force(p, place_m, any_speed_mps) != at_rest_n ||
            E::cart_force(p, place_m, -any_speed_mps) != at_rest_n) {
          force_n.reset();
          return;
        }
        (*force_n)[static_cast<Eigen::Index>(node)] = at_rest_n;
      }
    }
  });
  return force_n;
}

/// The effects that are a constant force while the cart moves.
bool is_constant_force(std::size_t effect) {
  const std::size_t constant = effect_number("constant_force");
  const std::vector<std::size_t> same = same_force_as(constant);
  return effect == constant || std::find(same.begin(), same.end(), effect) != same.end();
}

/// What the force of an effect is along the track. A curve bends.
enum class Shape { not_of_place, curve, slope, steep_slope, constant };

/// A slope is steep if the motor could not overcome its force half a track further. So it is no spring that
/// the cart takes along, but what the place has.
Shape shape_of(const PlantEffect& effect, const Search& search) {
  if (is_constant_force(effect.number)) return Shape::constant;
  constexpr CurveNodes anywhere{0.0, 0.1, 4};
  const auto force_n = force_of_place(effect, anywhere);
  if (!force_n) return Shape::not_of_place;
  const Eigen::Index inner = force_n->size() - 2;
  const Eigen::VectorXd bend = force_n->head(inner) - 2.0 * force_n->segment(1, inner) + force_n->tail(inner);
  constexpr double rounding = 1e-9;
  if (bend.cwiseAbs().maxCoeff() > rounding * force_n->cwiseAbs().maxCoeff()) return Shape::curve;
  const PriorPolicy& prior = search.policy().prior;
  const double half_a_track_n =
      std::abs((*force_n)[1] - (*force_n)[0]) / anywhere.spacing * prior.spring_center_m;
  const bool steep = half_a_track_n > prior.max_share_of_motor_force * search.range().largest_force_n;
  return steep ? Shape::steep_slope : Shape::slope;
}

class PlaceNull {
 public:
  PlaceNull(const Search& search, const Hypothesis& known)
      : search_(search),
        known_(known),
        all_(search.all_data()),
        places_(shown_places(all_)),
        nodes_(nodes_over(places_, search.budget().track_nodes)) {
    if (nodes_.count == 0) return;
    equations_ = equations_at(known.train.point);
    track_.emplace(equations_, nodes_);
  }

  /// Null if there is none.
  const RandomCurve* track_force() const { return track_ && track_->is_there() ? &*track_ : nullptr; }

  /// Standard errors of a straight line along the track, from what it saves.
  double certainty_of(double saved, Shape shape) const {
    return certainty_beside_track(saved, track_->effective_values(equations_),
                                  shape == Shape::slope ? 2.0 : 1.0);
  }

  /// What the effect saves beside the force.
  double saved_by(const PlantEffect& effect, Shape shape) const {
    if (!is_removable(known_.train.point.plant, effect.number, search_.given()))
      return std::numeric_limits<double>::infinity();
    const auto force_n = force_of_place(effect, nodes_);
    return (force_n ? replaced(*force_n, shape) : fitted_without(effect.number)) - track_->change();
  }

 private:
  /// By how much the objective rises without an effect of this force. The size and the length of the track's
  /// force are estimated anew then, but not for a constant force or a slope that may be a spring: a random
  /// force as long as the travel would be one itself. A constant force may stand in the place of such a
  /// slope.
  double replaced(const Eigen::VectorXd& force_n, Shape shape) const {
    if (shape == Shape::slope) return without_best_constant(force_n);
    return replaced_by_track(force_n, shape == Shape::constant);
  }

  /// The rise with the constant force that leaves the least: it is a parabola of this force.
  double without_best_constant(const Eigen::VectorXd& force_n) const {
    const double center_n = force_n.mean(), half_n = force_n.cwiseAbs().maxCoeff();
    const auto rise_at = [&](double constant_n) {
      return replaced_by_track((force_n.array() - constant_n).matrix(), true);
    };
    const double low = rise_at(center_n - half_n), middle = rise_at(center_n),
                 high = rise_at(center_n + half_n);
    const double bend = low - 2.0 * middle + high, slope = high - low;
    return bend > 0.0 ? middle - 0.125 * slope * slope / bend : middle;
  }

  /// By how much the objective rises if the track's force has to supply this one too. The innovations are
  /// linear in such a force, so nothing is fitted anew. `held`: the track's force keeps its size and length.
  double replaced_by_track(const Eigen::VectorXd& force_n, bool held) const {
    CurveEquations equations = equations_;
    const Eigen::VectorXd shift = equations.information * force_n;
    const double rise = force_n.dot(shift + 2.0 * equations.score);
    equations.score += shift;
    return rise + (held ? track_->change_with(equations) : RandomCurve(equations, nodes_).change());
  }

  /// By how much it rises in a fit without the effect, beside a track's force of its own size and length.
  double fitted_without(std::size_t effect) const {
    FitOptions same_noise;
    same_noise.noise_rounds = 0;
    const FitResult without =
        fit_without(all_, known_.train.point, effect, known_.free, search_.given(), same_noise);
    if (!std::isfinite(without.objective)) return std::numeric_limits<double>::infinity();
    return without.objective + RandomCurve(equations_at(without.point), nodes_).change() -
           known_.train.objective;
  }

  CurveEquations equations_at(const FitPoint& point) const {
    return curve_equations(linearise(all_, point), nodes_, places_);
  }

  const Search& search_;
  const Hypothesis& known_;
  FitData all_;
  std::vector<CurveArgument> places_;
  CurveNodes nodes_;
  CurveEquations equations_;  ///< at the fit with all effects
  std::optional<RandomCurve> track_;
};

/// Whether the other effects are judged beside this one before it may go.
bool goes_last(Shape shape) {
  return shape == Shape::constant || shape == Shape::steep_slope;
}

constexpr const char* as_well = "a random force that belongs to the place accounts for these data as well";

/// What a model would lack without an effect.
enum class Needed { no, as_average, by_itself };

/// Judged by simulations of held-out data: far worse ones without the effect, with a constant force in its
/// place or not.
Needed how_needed(Search& search, const Hypothesis& judged, const std::vector<Reproduction>& effects,
                  std::size_t effect) {
  std::vector<std::size_t> all, others;
  for (const Reproduction& other : effects) {
    all.push_back(other.effect);
    if (other.effect != effect) others.push_back(other.effect);
  }
  const double far_worse = search.policy().significance.clear_ratio * held_out_error(search, judged, all);
  if (held_out_error(search, judged, others) <= far_worse) return Needed::no;
  const std::size_t constant = effect_number("constant_force");
  if (judged.train.point.plant.find(constant) != nullptr) return Needed::by_itself;
  Hypothesis replaced = judged;
  replaced.train.point.plant.set(constant, std::array{0.0});
  others.push_back(constant);
  return held_out_error(search, replaced, others) > far_worse ? Needed::by_itself : Needed::as_average;
}

}  // namespace

double certainty_beside_track(double saved, double effective_values, double left_out) {
  const double freedom = std::max(effective_values - left_out, 1.0);
  return normal_deviate(std::sqrt(std::max(saved, 0.0) * freedom / (freedom + left_out)), freedom);
}

std::optional<Withdrawal> outdone_by_place(Search& search, const Hypothesis& known, const Hypothesis& judged,
                                           const std::vector<Reproduction>& effects) {
  std::optional<Withdrawal> worst;
  if (!search.is_of_all_data(known.train.point)) return worst;
  std::optional<PlaceNull> null;
  double least = search.policy().acceptance.min_evidence;
  const double noticeable_z = search.policy().significance.noticeable_z;
  for (const Reproduction& found : effects) {
    if (search.is_nuisance(found.effect)) continue;
    const PlantEffect& effect = *known.train.point.plant.find(found.effect);
    const Shape shape = shape_of(effect, search);
    if (goes_last(shape)) continue;
    if (!null) null.emplace(search, known);
    if (null->track_force() == nullptr) break;
    const double saved = null->saved_by(effect, shape);
    const double evidence = saved - search.penalty_of(known, effect.number);
    if (!(evidence < least)) continue;
    const bool may_be_average = shape == Shape::not_of_place ||
                                (shape == Shape::slope && null->certainty_of(saved, shape) > noticeable_z);
    const Needed needed = may_be_average ? how_needed(search, judged, effects, found.effect) : Needed::no;
    if (needed == Needed::by_itself) continue;
    least = evidence;
    worst = Withdrawal{found.effect, as_well, needed == Needed::as_average};
  }
  return worst;
}

std::optional<Withdrawal> trend_of_place(const Search& search, const Hypothesis& known) {
  if (!search.is_of_all_data(known.train.point)) return std::nullopt;
  const SelectionPolicy& policy = search.policy();
  std::optional<PlaceNull> null;
  for (const PlantEffect& effect : known.train.point.plant.effects) {
    const Shape shape = shape_of(effect, search);
    if (search.is_nuisance(effect.number) || !goes_last(shape)) continue;
    if (!null) null.emplace(search, known);
    if (null->track_force() == nullptr) return std::nullopt;
    const double evidence = null->saved_by(effect, shape) - search.penalty_of(known, effect.number);
    const bool is_noticed = null->certainty_of(evidence, shape) > policy.significance.noticeable_z;
    if (!is_noticed && evidence < policy.acceptance.overwhelming_evidence)
      return Withdrawal{effect.number, as_well};
  }
  return std::nullopt;
}

std::optional<TrackForce> track_force_left(const Search& search, const Hypothesis& known) {
  if (!search.is_of_all_data(known.train.point)) return std::nullopt;
  const PlaceNull null(search, known);
  const RandomCurve* track = null.track_force();
  if (track == nullptr || !(-track->change() > search.policy().acceptance.min_evidence)) return std::nullopt;
  return TrackForce{track->deviation(), track->length()};
}

std::string sentence_on(const TrackForce& left) {
  constexpr double mm_per_m = 1000.0;
  std::ostringstream text;
  text.precision(2);
  text << "the residual depends on the place: a random force of the track, with a standard deviation of "
       << left.deviation_n << " N and a correlation length of " << mm_per_m * left.correlation_m
       << " mm, accounts for a part of it";
  return text.str();
}

}  // namespace upright
