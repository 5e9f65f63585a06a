// Pairs of effects: the two can hide each other, so that a third one, which resembles both, is found instead.
#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "stepwise_selection.hpp"

namespace upright {

bool StepwiseSelection::find_pairs_of_all() {
  if (!try_pairs(resembling_)) return false;
  eliminate_backward();
  return true;
}

bool StepwiseSelection::try_pairs(const std::vector<std::pair<std::size_t, Hypothesis>>& contenders) {
  if (contenders.size() < 2) return false;
  std::optional<Hypothesis> best;
  std::vector<std::size_t> best_found;
  std::optional<double> to_beat;  // on the screening subset, by the best so far
  for (std::size_t a = 0; a < contenders.size(); ++a)
    for (std::size_t b = a + 1; b < contenders.size(); ++b) {
      const std::size_t first = contenders[a].first, second = contenders[b].first;
      if (found_.size() > 2 || (found_.size() == 2 && is_found(first) && is_found(second))) continue;
      if (!paired_.insert(std::minmax(first, second)).second) continue;
      options_.report_progress(0.83, "trying " + kind_of(first) + " with " + kind_of(second));
      const Hypothesis& so_far = best ? *best : current_;
      const Hypothesis quick = search_.screened_pair(given_, contenders[a].second, contenders[b].second);
      if (!to_beat) to_beat = search_.on_screening_subset(so_far).train.objective;
      const double gain = *to_beat - quick.train.objective - penalty_of_change(so_far, quick);
      if (!(gain > least_screened_gain())) continue;
      Hypothesis h = search_.with_pair(given_, contenders[a].second, contenders[b].second);
      Evidence e = evidence_of(Change::pair, so_far, h, {first, second});
      e.penalty = penalty_of_change(so_far, h);
      if (!decided(e, h, first).accepted) continue;
      best = std::move(h);
      best_found = {first, second};
      to_beat.reset();
    }
  if (!best) return false;
  for (const std::size_t effect : best_found)
    if (!where_.contains(effect)) where_[effect] = where_.empty() ? locate(given_) : where_.begin()->second;
  current_ = std::move(*best);
  found_ = best_found;
  record_step();
  return true;
}

}  // namespace upright
