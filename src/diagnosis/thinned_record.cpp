#include "thinned_record.hpp"

#include <algorithm>
#include <cmath>

#include "estimation/coarse_record.hpp"
#include "estimation/significant_digits.hpp"

namespace upright {

namespace {

std::size_t samples_of(const std::vector<Measurement>& runs) {
  std::size_t count = 0;
  for (const Measurement& run : runs) count += run.size();
  return count;
}

/// The place of a sample of the thinned run.
std::size_t place_in(const Measurement& run, double time_s) {
  return static_cast<std::size_t>(std::lower_bound(run.time_s.begin(), run.time_s.end(), time_s) -
                                  run.time_s.begin());
}

}  // namespace

std::vector<Measurement> thinned_runs(const std::vector<Measurement>& runs, const Plant& plant,
                                      const SearchBudget& budget) {
  std::vector<Measurement> thinned =
      coarse_runs(runs, plant, {budget.thinned_period_s, budget.thinned_shift});
  const std::size_t before = samples_of(runs), after = samples_of(thinned);
  const bool pays = static_cast<double>(before) >= budget.min_thinning_ratio * static_cast<double>(after);
  if (!pays || after < budget.min_thinned_samples) thinned.clear();
  return thinned;
}

Hypothesis fitted_to_all_samples(const Hypothesis& h, const FitData& thinned,
                                 const std::vector<Measurement>& runs) {
  FitData all{&runs, {}, thinned.bound};
  for (const Segment& segment : thinned.segments) {
    const std::vector<double>& time_s = (*thinned.runs)[segment.run].time_s;
    const Measurement& run = runs[segment.run];
    all.segments.push_back(
        {segment.run, place_in(run, time_s[segment.first]), place_in(run, time_s[segment.last])});
  }
  Hypothesis result = h;
  result.train = fit(all, h.train.point, h.free, FitOptions{});
  if (!std::isfinite(result.train.objective)) return h;
  round_to_significant_digits(result.train, result.free);
  return result;
}

}  // namespace upright
