#include "search.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "belief.hpp"
#include "estimation/significant_digits.hpp"
#include "model/dense_algebra.hpp"
#include "phases.hpp"
#include "plausibility.hpp"
#include "without_effect.hpp"

namespace upright {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// What a fit says of its parameters, as a belief. What it says nothing of is believed to be where it is.
GaussianPrior posterior_of(const Hypothesis& h) {
  const auto n = static_cast<Eigen::Index>(h.free.size());
  Eigen::VectorXd mean(n), min_sigma(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const FreeParameter& p = h.free[static_cast<std::size_t>(j)];
    mean[j] = h.train.point.plant.find(p.effect)->values[p.index];
    min_sigma[j] = 1e-6 * p.scale;
  }
  return belief_of(mean, h.train.covariance, min_sigma);
}

/// Of a symmetric positive semidefinite matrix; each zero among its pivots counts as 1e-300.
double log_determinant(const Eigen::MatrixXd& information) {
  if (information.size() == 0) return 0.0;
  return symmetric_pivots(information).array().abs().max(1e-300).log().sum();
}

}  // namespace

std::set<std::size_t> effects_of_both(const Hypothesis& first, const Hypothesis& second) {
  std::set<std::size_t> effects = first.added;
  effects.insert(second.added.begin(), second.added.end());
  return effects;
}

std::vector<ParameterEstimate> estimates_of(std::size_t effect, const Hypothesis& h) {
  std::vector<ParameterEstimate> result;
  const EffectInfo& info = effect_registry()[effect];
  for (std::size_t i = 0; i < info.parameters.size(); ++i) {
    ParameterEstimate e;
    e.name = info.parameters[i].name;
    e.unit = info.parameters[i].unit;
    e.value = h.train.point.plant.find(effect)->values[i];
    if (is_phase(info.parameters[i].name)) e.value = wrapped_phase(e.value);
    e.low = e.high = e.value;
    for (std::size_t j = 0; j < h.free.size(); ++j) {
      if (h.free[j].effect != effect || h.free[j].index != i) continue;
      const auto at = static_cast<Eigen::Index>(j);
      const double sigma = std::sqrt(std::max(h.train.covariance(at, at), 0.0));
      const double reach = h.train.bound_reach[at], half_width = 1.96 * sigma + reach;
      const Range& possible = info.parameters[i].range;
      const bool at_low = reach > 0.0 && e.value <= h.free[j].low;
      const bool at_high = reach > 0.0 && e.value >= h.free[j].high;
      if (!at_low) e.low = std::max(e.value - half_width, possible.low);
      if (!at_high) e.high = std::min(e.value + half_width, possible.high);
    }
    result.push_back(e);
  }
  return result;
}

Search::Search(const Plant& plant, const std::vector<Measurement>& runs, const FitData& train,
               const FitData& held, const SelectionPolicy& policy, const SearchBudget& budget)
    : policy_(policy),
      budget_(budget),
      given_(plant),
      plant_(plant),
      train_(train),
      held_(held),
      range_(range_of(runs, plant, policy.excitation)),
      starts_(policy, budget) {
  for (const PlantEffect& effect : plant.effects) nuisances_.push_back(effect.number);
  for (const std::size_t effect : base_corrections(plant, range_)) {
    nuisances_.push_back(effect);
    plant_.set(effect, std::vector<double>{effect_registry()[effect].parameters[0].neutral});
  }
  // Runs differ, segments of a run are alike: take them in turn.
  const std::size_t stride = std::clamp<std::size_t>(train_.segments.size() / budget_.min_screening_segments,
                                                     1, budget_.max_screening_stride);
  choose_screening_subset(stride);
  train_starts_ = estimate_initial_states(*train.runs, train.segments, plant_);
  held_starts_ = estimate_initial_states(*held.runs, held.segments, plant_);
}

bool Search::is_nuisance(std::size_t effect) const {
  return std::find(nuisances_.begin(), nuisances_.end(), effect) != nuisances_.end();
}

bool Search::is_unknown_zero(std::size_t effect) const {
  return effect == effect_number("angle_offset") && given_.find(effect) == nullptr;
}

std::vector<FreeParameter> Search::free_of(const std::set<std::size_t>& added) const {
  std::vector<FreeParameter> free;
  for (const std::size_t effect : nuisances_) {
    if (held_numbers_.contains(effect)) continue;
    const auto parameters = added.contains(effect)
                                ? free_parameters(effect, range_, policy_.prior)
                                : correction_parameters(given_, effect, range_, policy_.prior);
    free.insert(free.end(), parameters.begin(), parameters.end());
  }
  for (const std::size_t effect : added) {
    if (std::find(nuisances_.begin(), nuisances_.end(), effect) != nuisances_.end()) continue;
    const auto parameters = free_parameters(effect, range_, policy_.prior);
    free.insert(free.end(), parameters.begin(), parameters.end());
  }
  return free;
}

Hypothesis Search::fitted(const std::set<std::size_t>& added, const FitPoint& start,
                          const FitOptions& options, const std::vector<FreeParameter>& free) {
  Hypothesis h;
  h.added = added;
  h.free = free;
  h.train = fit(train_, start, free, options);
  h.valid = std::isfinite(h.train.objective);
  return h;
}

void Search::restart_with_low_noise(Hypothesis& h, const FitOptions& options) {
  if (!h.valid) return;
  FitPoint point = h.train.point;
  point.noise = reduced_process_noise(point.noise);
  Hypothesis again = fitted(h.added, point, options, h.free);
  if (again.train.objective < h.train.objective) h = std::move(again);
}

bool Search::may_restart_with_low_noise(const Hypothesis& base, const Hypothesis& h) const {
  // Where every bit of evidence counts, the whole data are asked.
  if (screening_subset_.segments.size() == train_.segments.size()) return true;
  if (!(base.train.objective - h.train.objective > budget_.clear_evidence)) return true;
  FitPoint point = screening_point(h);
  FitOptions options = steps_with_fixed_noise(budget_.screening_steps);
  options.noise_at_end_below = std::numeric_limits<double>::infinity();
  const double as_it_is = fit(screening_subset_, point, h.free, options).objective;
  point.noise = reduced_process_noise(point.noise);
  return fit(screening_subset_, point, h.free, {}).objective < as_it_is - budget_.restart_tolerance;
}

void Search::filter_held_out(Hypothesis& h, const Noise& noise) const {
  if (!std::isfinite(h.train.objective)) return;
  const FitPoint plain{plant_, held_starts_, noise};
  const FitPoint point = moved_to(plain, h.train.point.plant);
  h.held = fit_initial_states(held_, point, budget_.held_out_steps);
}

bool Search::is_plausible(const Hypothesis& h, std::size_t effect) const {
  for (const FreeParameter& p : h.free) {
    if (p.effect != effect) continue;
    const double value = h.train.point.plant.find(effect)->values[p.index];
    if (p.index == 0 && value == effect_registry()[effect].parameters[0].neutral) return false;
    if (kind_of(effect).starts_with("angle_offset") &&
        !shows_on_encoder(value, range_.theta_step_rad, policy_.correction))
      return false;
  }
  return is_admissible(h, effect);
}

bool Search::is_admissible(const Hypothesis& h, std::size_t effect) const {
  // A vibration at the slow or the fast end is none, and a counter that loses little is another effect.
  const bool all = attaches_mass(effect) || effect == effect_index<effects::LostCounts>();
  for (const FreeParameter& p : h.free) {
    if (p.effect != effect || (p.index != 0 && !all)) continue;
    const double value = h.train.point.plant.find(effect)->values[p.index];
    if (!(value < p.high) || (all && p.low > 0.0 && !(value > p.low))) return false;
  }
  return kind_of(effect) != "bristle_friction" || bristles_are_short(h);
}

bool Search::bends_one_of(const std::vector<std::size_t>& effects, const Hypothesis& before,
                          const Hypothesis& after, Holds holds) const {
  return std::any_of(effects.begin(), effects.end(), [&](std::size_t effect) {
    return (this->*holds)(before, effect) && !(this->*holds)(after, effect);
  });
}

bool Search::bristles_are_short(const Hypothesis& h) const {
  const Plant& plant = h.train.point.plant;
  const Dynamics<double> dynamics(make_model<double>(plant));
  const double breakaway_n = dynamics.cart_dry_level(range_.cart_mean_m, 0.0, 1.0);
  const double stiffness_n_per_m = plant.find(effect_number("bristle_friction"))->values[0];
  return are_bristles_short(breakaway_n, stiffness_n_per_m, range_.longest_travel_m, policy_.prior);
}

double Search::certainty(const Hypothesis& h, std::size_t effect) const {
  std::vector<Eigen::Index> own;
  for (std::size_t j = 0; j < h.free.size(); ++j)
    if (h.free[j].effect == effect) own.push_back(static_cast<Eigen::Index>(j));
  if (own.empty() || h.free[static_cast<std::size_t>(own.front())].index != 0) return 0.0;
  const PlantEffect* given = given_.find(effect);
  const double nothing =
      given != nullptr ? given->values[0] : effect_registry()[effect].parameters[0].neutral;
  if (!std::isfinite(nothing)) return infinity;
  const Eigen::MatrixXd covariance = h.train.covariance(own, own);
  if (!(covariance(0, 0) > 0.0)) return infinity;  // not estimated: held at the end of its range
  const Eigen::VectorXd scale = covariance.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::MatrixXd correlation =
      scale.cwiseInverse().asDiagonal() * covariance * scale.cwiseInverse().asDiagonal();
  const double held = pseudo_inverse(correlation)(0, 0);
  return std::abs(h.train.point.plant.find(effect)->values[0] - nothing) / scale[0] *
         std::sqrt(std::max(held, 1.0));
}

double Search::penalty_of(const Hypothesis& h, std::size_t effect) const {
  const auto parameters =
      std::count_if(h.free.begin(), h.free.end(), [&](const FreeParameter& p) { return p.effect == effect; });
  return policy_.acceptance.parameter_penalty * std::max(static_cast<double>(parameters) - 1.0, 0.0);
}

void Search::predict_held_out(Hypothesis& h) const {
  filter_held_out(h, h.train.point.noise);
  if (std::isfinite(h.train.objective))
    h.negative_log_predictive_density = negative_log_predictive_density_of(h);
}

double Search::negative_log_predictive_density_of(const Hypothesis& h) const {
  if (!std::isfinite(h.held.objective) || held_.segments.empty()) return h.held.objective;
  FitOptions options;
  options.noise_rounds = budget_.predictive_noise_rounds;
  options.max_iterations = budget_.predictive_steps;
  options.joint_prior = posterior_of(h);
  const FitResult conditioned = fit(held_, h.held.point, h.free, options);
  // Laplace's approximation of the likelihood, averaged over what the training runs left open.
  return conditioned.objective + log_determinant(conditioned.information) -
         log_determinant(options.joint_prior->information);
}

Hypothesis Search::conditioned_on_held_out(const Hypothesis& h) const {
  FitOptions options;
  options.noise_rounds = 0;
  options.joint_prior = posterior_of(h);
  FitPoint point = h.held.point;
  point.noise = h.train.point.noise;
  const FitResult held = fit(held_, point, h.free, options);
  if (!std::isfinite(held.objective)) return h;
  Hypothesis result = h;
  result.train.point.plant = held.point.plant;
  result.held = held;
  result.forget_simulations();
  return result;
}

Hypothesis Search::baseline() {
  const FitPoint start =
      with_fitted_initial_states(train_, {plant_, train_starts_, {.force = 0.1, .torque = 0.01}});
  FitOptions options;
  Hypothesis h = fitted({}, start, options, free_of({}));
  options.max_iterations = budget_.baseline_restart_steps;
  restart_with_low_noise(h, options);
  predict_held_out(h);
  return h;
}

std::vector<FitPoint> Search::points_with(const FitPoint& from, std::size_t effect,
                                          const Hypothesis& base) const {
  if (from.plant.find(effect) != nullptr) return {from};
  std::vector<FitPoint> points;
  for (const std::vector<double>& values : starts_of(effect, base)) {
    Plant plant = from.plant;
    plant.set(effect, values);
    points.push_back(moved_to(from, plant));
  }
  return points;
}

void Search::refit(const Hypothesis& base, Hypothesis& h) {
  if (!std::isfinite(h.train.objective)) return;
  FitOptions options;
  options.alternative_noise = base.train.point.noise;
  FitPoint point = moved_to(base.train.point, h.train.point.plant);
  point.noise = h.train.point.noise;
  h = fitted(h.added, point, options, h.free);
}

void Search::refine(const Hypothesis& base, Hypothesis& h) {
  if (!std::isfinite(h.train.objective)) return;
  refit(base, h);
  if (may_restart_with_low_noise(base, h)) restart_with_low_noise(h, {});
  predict_held_out(h);
}

Hypothesis Search::with_new_initial_states(const Hypothesis& base) {
  FitPoint point = base.train.point;
  point.starts = estimate_initial_states(*train_.runs, train_.segments, point.plant);
  Hypothesis h = fitted(base.added, point, FitOptions{}, base.free);
  const Hypothesis followed =
      fitted(base.added, with_fitted_initial_states(train_, h.train.point), FitOptions{}, base.free);
  if (followed.train.objective < h.train.objective) h = followed;
  restart_with_low_noise(h, {});
  predict_held_out(h);
  return h;
}

Hypothesis Search::exchanged(const Hypothesis& base, std::size_t effect,
                             const std::vector<PlantEffect>& others) {
  std::set<std::size_t> added = base.added;
  Plant plant = base.train.point.plant;
  added.erase(effect);
  plant.remove(effect);
  for (const PlantEffect& other : others) {
    added.insert(other.number);
    plant.set(other.number, other.values);
  }
  Hypothesis h = fitted(added, moved_to(base.train.point, plant), FitOptions{}, free_of(added));
  predict_held_out(h);
  return h;
}

Hypothesis Search::with_held_numbers(const Hypothesis& base) {
  Plant plant = base.train.point.plant;
  for (const std::size_t number : held_numbers_) plant.set(number, plant_.find(number)->values);
  Hypothesis h = fitted(base.added, moved_to(base.train.point, plant), FitOptions{}, free_of(base.added));
  predict_held_out(h);
  return h;
}

Hypothesis Search::without(const Hypothesis& base, std::size_t effect) {
  std::set<std::size_t> added = base.added;
  added.erase(effect);
  const Plant plant = without_effect(base.train.point.plant, effect, plant_);
  Hypothesis h;
  h.train.objective = infinity;
  if (!fault_of(plant).empty()) return h;
  const FitPoint point = moved_to(base.train.point, plant);
  FitOptions options;
  h = fitted(added, point, options, free_of(added));
  predict_held_out(h);
  return h;
}

Hypothesis Search::fitted_separately(const std::vector<std::size_t>& effects, const Hypothesis& from,
                                     const Noise* fixed_noise, bool settled,
                                     std::optional<std::size_t> as_given) {
  Plant plant = plant_;
  std::vector<FreeParameter> free;
  const auto include = [&](std::size_t effect, const std::vector<FreeParameter>& parameters) {
    if (const PlantEffect* reached = from.train.point.plant.find(effect)) plant.set(effect, reached->values);
    free.insert(free.end(), parameters.begin(), parameters.end());
  };
  for (const std::size_t effect : effects) {
    // What stands in the plant file is believed, if less firmly, even where the data correct it.
    const bool correction = is_nuisance(effect);
    std::vector<FreeParameter> parameters = correction
                                                ? correction_parameters(given_, effect, range_, policy_.prior)
                                                : free_parameters(effect, range_, policy_.prior);
    for (FreeParameter& p : parameters) p.prior_sigma *= correction ? policy_.correction.prior_widening : 1.0;
    include(effect, parameters);
  }
  for (const std::size_t effect : nuisances_) {
    if (std::find(effects.begin(), effects.end(), effect) != effects.end()) continue;
    const bool held = held_numbers_.contains(effect) || effect == as_given;
    if (is_unknown_zero(effect) || (settled && !held))
      include(effect, correction_parameters(given_, effect, range_, policy_.prior));
  }
  FitPoint point = moved_to(from.train.point, plant);
  FitOptions options;
  if (fixed_noise != nullptr) options.noise_rounds = 0;
  if (fixed_noise != nullptr) point.noise = *fixed_noise;
  return fitted({effects.begin(), effects.end()}, point, options, free);
}

FitData Search::all_data() const {
  FitData all = train_;
  all.segments.insert(all.segments.end(), held_.segments.begin(), held_.segments.end());
  return all;
}

bool Search::is_of_all_data(const FitPoint& fitted) const {
  return fitted.starts.size() == train_.segments.size() + held_.segments.size();
}

FitData Search::data_of(const FitPoint& fitted) const {
  return is_of_all_data(fitted) ? all_data() : train_;
}

FitResult Search::with_coloured_noise(const Hypothesis& known) const {
  FitOptions options;
  options.coloured_noise = true;
  return fit(data_of(known.train.point), known.train.point, {}, options);
}

Hypothesis Search::fitted_to_all_runs(const Hypothesis& h) const {
  const FitData all = all_data();
  FitPoint point = h.train.point;
  point.starts.insert(point.starts.end(), h.held.point.starts.begin(), h.held.point.starts.end());
  Hypothesis result = h;
  result.forget_simulations();
  result.train = fit(all, point, h.free, FitOptions{});
  result.valid = std::isfinite(result.train.objective);
  if (!result.valid) return h;
  round_to_significant_digits(result.train, result.free);
  return result;
}

Eigen::MatrixXd Search::covariance_from_held_numbers(const FitData& data, const Hypothesis& fitted) const {
  const auto n = static_cast<Eigen::Index>(fitted.free.size());
  if (held_numbers_.empty()) return Eigen::MatrixXd::Zero(n, n);
  std::vector<FreeParameter> free = fitted.free;
  for (const std::size_t number : held_numbers_)
    for (const FreeParameter& p : correction_parameters(given_, number, range_, policy_.prior))
      free.push_back(p);
  const FitOptions linearise_only = steps_with_fixed_noise(0);
  const FitResult beside = fit(data, fitted.train.point, free, linearise_only);
  if (!std::isfinite(beside.objective)) return Eigen::MatrixXd::Zero(n, n);
  const Eigen::Index held = beside.information.rows() - n;
  // How the free ones move with the held ones: a block of the inverse of the information.
  const Eigen::MatrixXd moved =
      solve_symmetric(beside.information.topLeftCorner(n, n), beside.information.topRightCorner(n, held));
  return moved * beside.covariance.bottomRightCorner(held, held) * moved.transpose();
}

Hypothesis Search::with_effect_free(const Hypothesis& h, std::size_t effect, double share_of_typical) const {
  Hypothesis result;
  result.added = h.added;
  result.free = h.free;
  FitPoint point = h.train.point;
  const EffectInfo& info = effect_registry()[effect];
  bool there = false;
  for (FreeParameter& p : result.free) {
    if (p.effect != effect) continue;
    p.prior_sigma = 0.0;
    there = true;
  }
  if (!there) {
    if (point.plant.find(effect) == nullptr) {
      std::vector<double> values = search_starts(effect, range_, policy_.prior, budget_).front();
      for (std::size_t i = 0; i < values.size(); ++i)
        if (!std::isnan(info.parameters[i].neutral))
          values[i] =
              info.parameters[i].neutral + share_of_typical * (values[i] - info.parameters[i].neutral);
      Plant plant = point.plant;
      plant.set(effect, values);
      point = moved_to(point, plant);
    }
    for (FreeParameter p : free_parameters(effect, range_, policy_.prior)) {
      // Where it does nothing may be the end of its range.
      p.low = -infinity;
      p.high = infinity;
      result.free.push_back(p);
    }
  }
  const FitOptions linearise_only = steps_with_fixed_noise(0);
  result.train = fit(train_, point, result.free, linearise_only);
  result.valid = std::isfinite(result.train.objective);
  return result;
}

FitPoint Search::pair_point(const Hypothesis& base, const Hypothesis& first, const Hypothesis& second) const {
  Plant plant = base.train.point.plant;
  Noise noise = base.train.point.noise;
  for (const Hypothesis* h : {&first, &second}) {
    const Noise& other = h->train.point.noise;
    noise.force = std::min(noise.force, other.force);
    noise.torque = std::min(noise.torque, other.torque);
    noise.coloured_force_n = std::min(noise.coloured_force_n, other.coloured_force_n);
    noise.coloured_torque_nm = std::min(noise.coloured_torque_nm, other.coloured_torque_nm);
    for (const std::size_t effect : h->added) plant.set(effect, h->train.point.plant.find(effect)->values);
  }
  FitPoint point = moved_to(base.train.point, plant);
  point.noise = noise;
  return point;
}

Hypothesis Search::with_pair(const Hypothesis& base, const Hypothesis& first, const Hypothesis& second) {
  const std::set<std::size_t> added = effects_of_both(first, second);
  Hypothesis h = fitted(added, pair_point(base, first, second), FitOptions{}, free_of(added));
  predict_held_out(h);
  return h;
}

std::vector<std::vector<double>> Search::starts_of(std::size_t effect, const Hypothesis& base) const {
  return starts_.of(effect, range_, train_, base.train.point);
}

}  // namespace upright
