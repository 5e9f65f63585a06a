#include "exploration.hpp"

#include <algorithm>

#include "estimation/coarse_record.hpp"
#include "estimation/held_out.hpp"
#include "without_effect.hpp"

namespace upright {

namespace {

FitData coarse(const FitData& data, const std::vector<Measurement>& runs) {
  return {&runs, coarse_segments(data.segments, *data.runs, runs), data.bound};
}

}  // namespace

Hypothesis Search::refitted(const Hypothesis& other) {
  const FitPoint start{plant_, train_starts_, other.train.point.noise};
  Hypothesis h =
      fitted(other.added, with_fitted_initial_states(train_, moved_to(start, other.train.point.plant)),
             FitOptions{}, other.free);
  predict_held_out(h);
  return h;
}

Exploration::Exploration(const Search& search, const DiagnosisOptions& options)
    : runs_(coarse_runs(*search.train_data().runs, search.given(), search.budget().exploration_period_s)),
      train_(coarse(search.train_data(), runs_)),
      held_(coarse(search.held_data(), runs_)),
      sample_ratio_(sample_count(search.train_data()) / std::max(sample_count(train_), 1.0)),
      search_(search.given(), *search.train_data().runs, train_, held_, search.policy(), search.budget()),
      selection_(search_, options, record_) {}

std::unique_ptr<Exploration> Exploration::of(const Search& search, const DiagnosisOptions& options) {
  auto exploration = std::make_unique<Exploration>(search, options);
  const bool whole = !exploration->train_.segments.empty() &&
                     exploration->held_.segments.empty() == search.held_data().segments.empty();
  if (whole && exploration->sample_ratio_ >= search.budget().min_exploration_ratio) return exploration;
  return nullptr;
}

}  // namespace upright
