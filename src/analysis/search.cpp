#include "upright/analysis/search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "upright/analysis/residual.hpp"

namespace upright {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace

Improvement compare(const Hypothesis& simpler, const Hypothesis& richer) {
  Improvement result;
  if (!std::isfinite(richer.train.objective)) return {-infinity, -infinity, -infinity, -infinity};
  std::vector<double> falls, held_falls;
  for (std::size_t s = 0; s < simpler.train.segment_objective.size(); ++s)
    falls.push_back(simpler.train.segment_objective[s] - richer.train.segment_objective[s]);
  for (std::size_t s = 0; s < simpler.held.segment_objective.size(); ++s)
    held_falls.push_back(simpler.held.segment_objective[s] - richer.held.segment_objective[s]);
  result.train = simpler.train.objective - richer.train.objective;
  const auto t_of = [](const std::vector<double>& values) {
    const auto n = static_cast<double>(values.size());
    if (values.size() < 2) return 0.0;
    double mean = 0.0, spread = 0.0;
    for (const double f : values) mean += f / n;
    for (const double f : values) spread += (f - mean) * (f - mean) / (n - 1.0);
    return mean / std::sqrt(std::max(spread / n, 1e-12));
  };
  for (const double f : held_falls) result.held += f;
  result.held_t = t_of(held_falls);
  falls.insert(falls.end(), held_falls.begin(), held_falls.end());
  result.t_value = t_of(falls);
  return result;
}

Search::Search(const Plant& plant, const std::vector<Measurement>& runs, const FitData& train,
               const FitData& held)
    : given_(plant), plant_(plant), runs_(runs), train_(train), held_(held), range_(range_of(runs)) {
  for (const PlantEffect& effect : plant.effects) nuisances_.push_back(effect.number);
  for (const std::size_t effect : base_corrections(plant, range_)) {
    nuisances_.push_back(effect);
    plant_.set(effect, std::vector<double>{effect_registry()[effect].parameters[0].neutral});
  }
  // Runs differ, segments of a run are alike: take them in turn.
  const std::size_t stride = train_.segments.size() >= 24 ? 3 : 1;
  sieve_.runs = &runs;
  for (std::size_t s = 0; s < train_.segments.size(); s += stride) {
    sieve_.segments.push_back(train_.segments[s]);
    sieve_places_.push_back(s);
  }
  train_starts_ = guess_starts(runs, train.segments, plant_);
  held_starts_ = guess_starts(runs, held.segments, plant_);
}

std::vector<FreeParameter> Search::free_of(const std::set<std::size_t>& added) const {
  std::vector<FreeParameter> free;
  for (const std::size_t effect : nuisances_) {
    const auto parameters = added.contains(effect) ? free_parameters(effect, range_)
                                                   : believed_parameters(given_, effect, range_);
    free.insert(free.end(), parameters.begin(), parameters.end());
  }
  for (const std::size_t effect : added) {
    if (std::find(nuisances_.begin(), nuisances_.end(), effect) != nuisances_.end()) continue;
    const auto parameters = free_parameters(effect, range_);
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

void Search::judge(Hypothesis& h, const Noise* noise) {
  if (!std::isfinite(h.train.objective)) return;
  FitOptions options;
  options.starts_only = true;
  options.noise_rounds = 0;
  options.most_iterations = 6;
  FitPoint point{h.train.point.plant, held_starts_, noise != nullptr ? *noise : h.train.point.noise};
  h.held = fit(held_, point, {}, options);
}

Hypothesis Search::baseline() {
  FitOptions options;
  Hypothesis h = fitted({}, {plant_, train_starts_, {.force = 0.1, .torque = 0.01}}, options, free_of({}));
  judge(h);
  return h;
}

Hypothesis Search::screened(const Hypothesis& base, std::size_t effect) {
  std::set<std::size_t> added = base.added;
  added.insert(effect);
  const std::vector<FreeParameter> free = free_of(added);
  FitOptions options;
  options.noise_rounds = 0;
  options.noise_last = true;
  options.most_iterations = 4;
  FitPoint from = base.train.point;
  from.starts.clear();
  for (const std::size_t place : sieve_places_) from.starts.push_back(base.train.point.starts[place]);
  Hypothesis best;
  best.train.objective = infinity;
  const bool correction = from.plant.find(effect) != nullptr;
  for (const std::vector<double>& values :
       correction ? std::vector<std::vector<double>>{{}} : starts_of(effect, base)) {
    FitPoint point = from;
    if (!correction) point.plant.set(effect, values);
    Hypothesis h;
    h.added = added;
    h.free = free;
    h.train = fit(sieve_, point, free, options);
    if (h.train.objective < best.train.objective) best = std::move(h);
  }
  return best;
}

Hypothesis Search::sieved(const Hypothesis& base) const {
  FitOptions options;
  options.noise_rounds = 0;
  options.noise_last = true;
  options.most_iterations = 2;
  FitPoint point = base.train.point;
  point.starts.clear();
  for (const std::size_t place : sieve_places_) point.starts.push_back(base.train.point.starts[place]);
  Hypothesis h;
  h.added = base.added;
  h.free = base.free;
  h.train = fit(sieve_, point, base.free, options);
  return h;
}

void Search::refine(const Hypothesis& base, Hypothesis& h) {
  if (!std::isfinite(h.train.objective)) return;
  FitOptions options;
  FitPoint point{h.train.point.plant, base.train.point.starts, h.train.point.noise};
  h = fitted(h.added, point, options, h.free);
  judge(h);
}

Hypothesis Search::without(const Hypothesis& base, std::size_t effect) {
  std::set<std::size_t> added = base.added;
  added.erase(effect);
  FitPoint point = base.train.point;
  if (const PlantEffect* given = plant_.find(effect)) {
    point.plant.set(effect, given->values);
  } else {
    point.plant.remove(effect);
  }
  Hypothesis h;
  h.train.objective = infinity;
  if (!fault_of(point.plant).empty()) return h;
  FitOptions options;
  h = fitted(added, point, options, free_of(added));
  judge(h);
  return h;
}

Hypothesis Search::only(const std::vector<std::size_t>& effects, const Hypothesis& from,
                        const Noise* fixed_noise, bool settled) {
  FitPoint point = from.train.point;
  point.plant = plant_;
  std::vector<FreeParameter> free;
  const auto include = [&](std::size_t effect, const std::vector<FreeParameter>& parameters) {
    if (const PlantEffect* reached = from.train.point.plant.find(effect))
      point.plant.set(effect, reached->values);
    free.insert(free.end(), parameters.begin(), parameters.end());
  };
  for (const std::size_t effect : effects) {
    // What stands in the plant file is believed, if less firmly, even where the data correct it.
    const bool correction = std::find(nuisances_.begin(), nuisances_.end(), effect) != nuisances_.end();
    constexpr double less_firmly = 4.0;
    std::vector<FreeParameter> parameters =
        correction ? believed_parameters(given_, effect, range_) : free_parameters(effect, range_);
    for (FreeParameter& p : parameters) p.prior_sigma *= correction ? less_firmly : 1.0;
    include(effect, parameters);
  }
  for (const std::size_t effect : nuisances_) {
    if (std::find(effects.begin(), effects.end(), effect) != effects.end()) continue;
    // The zero of the angle is known to a count only, whatever else is.
    const bool zero = effect == effect_number("angle_offset") && given_.find(effect) == nullptr;
    if (settled || zero) include(effect, believed_parameters(given_, effect, range_));
  }
  FitOptions options;
  if (fixed_noise != nullptr) options.noise_rounds = 0;
  if (fixed_noise != nullptr) point.noise = *fixed_noise;
  Hypothesis h = fitted({effects.begin(), effects.end()}, point, options, free);
  judge(h);
  return h;
}

Hypothesis Search::with_pair(const Hypothesis& base, const Hypothesis& first, const Hypothesis& second) {
  std::set<std::size_t> added = first.added;
  added.insert(second.added.begin(), second.added.end());
  FitPoint point = base.train.point;
  for (const Hypothesis* h : {&first, &second}) {
    point.noise.force = std::min(point.noise.force, h->train.point.noise.force);
    point.noise.torque = std::min(point.noise.torque, h->train.point.noise.torque);
    for (const std::size_t effect : h->added)
      point.plant.set(effect, h->train.point.plant.find(effect)->values);
  }
  Hypothesis h = fitted(added, point, FitOptions{}, free_of(added));
  judge(h);
  return h;
}

std::vector<std::pair<double, double>> Search::force_residual(const Hypothesis& base) const {
  std::vector<std::pair<double, double>> pairs;
  for (const ResidualTrace& trace : smooth_residuals(train_, base.train.point))
    for (std::size_t k = 0; k < trace.time_s.size(); ++k)
      if (std::abs(trace.cart_mps[k]) > 1e-3) pairs.emplace_back(trace.cart_m[k], trace.force_n[k]);
  constexpr std::size_t most = 4000;
  if (pairs.size() > most) {
    std::vector<std::pair<double, double>> thinned;
    for (std::size_t i = 0; i < most; ++i) thinned.push_back(pairs[i * pairs.size() / most]);
    pairs = thinned;
  }
  return pairs;
}

std::vector<std::vector<double>> Search::starts_of(std::size_t effect, const Hypothesis& base) const {
  const bool cogging = effect_registry()[effect].kind == "cogging_force";
  return search_starts(effect, plant_, range_,
                       cogging ? force_residual(base) : std::vector<std::pair<double, double>>{});
}

}  // namespace upright
