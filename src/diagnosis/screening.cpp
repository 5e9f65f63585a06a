// What is tried on a part of the training data first: which candidates are worth a whole fit.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "search.hpp"

namespace upright {

void Search::choose_screening_subset(std::size_t stride) {
  screening_subset_ = {train_.runs, {}, train_.bound};
  screening_places_.clear();
  for (std::size_t s = 0; s < train_.segments.size(); s += stride) {
    screening_subset_.segments.push_back(train_.segments[s]);
    screening_places_.push_back(s);
  }
}

void Search::screen_on_all() {
  choose_screening_subset(1);
}

bool Search::screen_on_largest_voltage() {
  const double start_v = highest_saturation_start * largest_voltage_v(train_);
  if (!(largest_voltage_v(screening_subset_) < start_v)) return false;
  const std::size_t place = most_driven_segment(train_);
  const auto before = std::ranges::lower_bound(screening_places_, place) - screening_places_.begin();
  screening_places_.insert(screening_places_.begin() + before, place);
  screening_subset_.segments.insert(screening_subset_.segments.begin() + before, train_.segments[place]);
  return true;
}

std::vector<PlantState<double>> Search::screening_starts(
    const std::vector<PlantState<double>>& starts) const {
  std::vector<PlantState<double>> some;
  some.reserve(screening_places_.size());
  for (const std::size_t place : screening_places_) some.push_back(starts[place]);
  return some;
}

FitPoint Search::screening_point(const Hypothesis& base) const {
  return {base.train.point.plant, screening_starts(base.train.point.starts), base.train.point.noise};
}

double Search::predicted_objective(const FitPoint& point, const std::vector<FreeParameter>& free) const {
  const FitResult seen = fit(screening_subset_, point, free, steps_with_fixed_noise(0));
  return seen.predicted_reduction ? seen.objective - *seen.predicted_reduction
                                  : -std::numeric_limits<double>::infinity();
}

std::vector<double> Search::predicted_gains(const Hypothesis& base,
                                            const std::vector<std::size_t>& effects) const {
  const FitPoint from = screening_point(base);
  const double without = predicted_objective(from, base.free);
  std::vector<double> gains;
  for (const std::size_t effect : effects) {
    std::set<std::size_t> added = base.added;
    added.insert(effect);
    const std::vector<FreeParameter> free = free_of(added);
    double best = std::numeric_limits<double>::infinity();
    for (const FitPoint& point : points_with(from, effect, base))
      best = std::min(best, predicted_objective(point, free));
    gains.push_back(std::isfinite(without) ? without - best : std::numeric_limits<double>::infinity());
  }
  return gains;
}

std::vector<FitPoint> Search::screening_points(const Hypothesis& base, std::size_t effect,
                                               const std::vector<FreeParameter>& free) const {
  std::vector<FitPoint> points = points_with(screening_point(base), effect, base);
  if (!is_periodic(effect) || points.size() < 2) return points;
  std::vector<double> promised;
  promised.reserve(points.size());
  for (const FitPoint& point : points)
    promised.push_back(objective_after_step(screening_subset_, point, free));
  return {points[static_cast<std::size_t>(std::ranges::min_element(promised) - promised.begin())]};
}

Hypothesis Search::screened(const Hypothesis& base, std::size_t effect, double to_reach) const {
  Hypothesis h;
  h.added = base.added;
  h.added.insert(effect);
  h.free = free_of(h.added);
  h.train.objective = std::numeric_limits<double>::infinity();
  for (const FitPoint& point : screening_points(base, effect, h.free)) {
    FitResult reached =
        fit(screening_subset_, point, h.free, steps_with_fixed_noise(budget_.screening_steps));
    if (reached.objective < h.train.objective) h.train = std::move(reached);
  }
  if (h.train.objective < to_reach) renew_noise_on_subset(h);
  return h;
}

Hypothesis Search::screened_pair(const Hypothesis& base, const Hypothesis& first,
                                 const Hypothesis& second) const {
  FitPoint point = pair_point(base, first, second);
  point.starts = screening_starts(point.starts);
  Hypothesis h;
  h.added = effects_of_both(first, second);
  h.free = free_of(h.added);
  // Each was fitted as if it were alone: the way from there is longer than a few steps.
  h.train = fit(screening_subset_, point, h.free, FitOptions{});
  return h;
}

void Search::converge_on_subset(Hypothesis& h) const {
  if (std::isfinite(h.train.objective)) h.train = fit(screening_subset_, h.train.point, h.free, {});
}

Hypothesis Search::descended_on_subset(const Hypothesis& base) const {
  Hypothesis h;
  h.added = base.added;
  h.free = base.free;
  h.train = fit(screening_subset_, screening_point(base), base.free,
                steps_with_fixed_noise(budget_.screening_reference_steps));
  return h;
}

void Search::renew_noise_on_subset(Hypothesis& h) const {
  FitOptions options = steps_with_fixed_noise(0);
  options.noise_at_end = true;
  h.train = fit(screening_subset_, h.train.point, h.free, options);
}

Hypothesis Search::on_screening_subset(const Hypothesis& base) const {
  Hypothesis h = descended_on_subset(base);
  renew_noise_on_subset(h);
  return h;
}

}  // namespace upright
