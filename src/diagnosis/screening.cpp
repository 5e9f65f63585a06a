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

double Search::objective_to_come(const FitResult& seen) {
  return seen.predicted_reduction ? seen.objective - *seen.predicted_reduction
                                  : -std::numeric_limits<double>::infinity();
}

std::vector<FitResult> Search::linearised_starts(const Hypothesis& base, std::size_t effect) const {
  std::set<std::size_t> added = base.added;
  added.insert(effect);
  const std::vector<FreeParameter> free = free_of(added);
  FitOptions options = steps_with_fixed_noise(0);
  options.keep_equations = true;
  const std::vector<FitPoint> points = points_with(screening_point(base), effect, base);
  std::vector<FitResult> starts;
  starts.reserve(points.size());
  for (const FitPoint& point : points) starts.push_back(fit(screening_subset_, point, free, options));
  return starts;
}

std::vector<FitResult> Search::without_other_pitches(std::size_t effect, std::vector<FitResult> starts) {
  if (!is_periodic(effect) || starts.size() < 2) return starts;
  const auto promised = [](const FitResult& start) { return objective_after_step(start); };
  return {*std::ranges::min_element(starts, {}, promised)};
}

std::vector<Prediction> Search::predictions(const Hypothesis& base,
                                            const std::vector<std::size_t>& effects) const {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const double without =
      objective_to_come(fit(screening_subset_, screening_point(base), base.free, steps_with_fixed_noise(0)));
  std::vector<Prediction> predictions;
  predictions.reserve(effects.size());
  for (const std::size_t effect : effects) {
    std::vector<FitResult> starts = linearised_starts(base, effect);
    double lowest = infinity;
    for (const FitResult& start : starts) lowest = std::min(lowest, objective_to_come(start));
    const double gain = std::isfinite(without) ? without - lowest : infinity;
    predictions.push_back({gain, without_other_pitches(effect, std::move(starts))});
  }
  return predictions;
}

Hypothesis Search::screened(const Hypothesis& base, std::size_t effect, const std::vector<FitResult>& starts,
                            double to_reach) const {
  Hypothesis h;
  h.added = base.added;
  h.added.insert(effect);
  h.free = free_of(h.added);
  h.train.objective = std::numeric_limits<double>::infinity();
  FitOptions options = steps_with_fixed_noise(budget_.screening_steps);
  // Of several starts only the best needs another noise.
  const bool alone = starts.size() == 1;
  if (alone) options.noise_at_end_below = to_reach;
  for (const FitResult& start : starts) {
    FitResult reached = continue_fit(screening_subset_, start, h.free, options);
    if (reached.objective < h.train.objective) h.train = std::move(reached);
  }
  if (!alone && h.train.objective < to_reach) renew_noise_on_subset(h);
  return h;
}

Hypothesis Search::screened(const Hypothesis& base, std::size_t effect) const {
  return screened(base, effect, without_other_pitches(effect, linearised_starts(base, effect)),
                  std::numeric_limits<double>::infinity());
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
  options.noise_at_end_below = std::numeric_limits<double>::infinity();
  h.train = fit(screening_subset_, h.train.point, h.free, options);
}

Hypothesis Search::on_screening_subset(const Hypothesis& base) const {
  Hypothesis h = descended_on_subset(base);
  renew_noise_on_subset(h);
  return h;
}

}  // namespace upright
