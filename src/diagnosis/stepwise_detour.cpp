// The part of the selection that leaves its path: one wrong name at the beginning can keep all others away,
// and what has states of its own is no candidate on it.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "estimation/attached_start.hpp"
#include "stepwise_selection.hpp"

namespace upright {

bool StepwiseSelection::find_without_each() {
  const std::vector<std::size_t> effects = found_;
  return std::any_of(effects.begin(), effects.end(), [&](std::size_t effect) {
    return !similar_effects_[effect].empty() && find_without(effect);
  });
}

bool StepwiseSelection::find_without(std::size_t effect) {
  options_.report_progress(0.84, "searching without " + kind_of(effect));
  Checkpoint other{search_.without(current_, effect), found_};
  if (!std::isfinite(other.hypothesis.train.objective)) return false;
  std::erase(other.found, effect);
  const Goal goal{current_.train.objective, search_.on_screening_subset(current_).train.objective};
  const bool contradicted = contradicted_;
  const auto exchange_paths = [&] {
    std::swap(current_, other.hypothesis);
    std::swap(found_, other.found);
  };
  exchange_paths();
  withdrawn_.insert(effect);
  const auto return_to_path = [&] {
    withdrawn_.erase(effect);
    contradicted_ = contradicted;
    exchange_paths();
  };
  try {
    find_again(goal);
  } catch (...) {  // the search may end at any time: what was found before it counts
    return_to_path();
    throw;
  }
  return_to_path();
  std::vector<std::size_t> brought;
  std::copy_if(other.found.begin(), other.found.end(), std::back_inserter(brought),
               [&](std::size_t of) { return !is_found(of); });
  if (brought.empty()) return false;
  Evidence e = evidence_of(Change::pair, current_, other.hypothesis, brought);
  e.penalty = penalty_of_change(current_, other.hypothesis);
  const bool better = decided(e, other.hypothesis, brought.front()).accepted;
  if (better) {
    current_ = std::move(other.hypothesis);
    found_ = std::move(other.found);
  }
  record_step();
  return better;
}

void StepwiseSelection::find_again(const Goal& goal) {
  select_forward(3 * budget_.max_rounds, 4 * budget_.max_rounds, false, goal);
  if (current_.train.objective <= goal.objective) eliminate_backward();
}

bool StepwiseSelection::is_out_of_reach_of(const std::vector<ScreenedCandidate>& screened, const Goal& goal,
                                           int rounds_left) {
  double objective = std::numeric_limits<double>::infinity(), gain = 0.0;
  for (const ScreenedCandidate& s : screened) {
    objective = std::min(objective, s.hypothesis.train.objective);
    gain = std::max(gain, s.gain);
  }
  return is_out_of_reach(objective - goal.on_subset, gain, rounds_left);
}

bool StepwiseSelection::find_attached_mass(bool certainly_missing) {
  const int round = 4 * budget_.max_rounds;
  const double to_beat = search_.on_screening_subset(current_).train.objective;
  without_attached_mass_.emplace(Checkpoint{std::exchange(current_, given_), std::exchange(found_, {})});
  try {
    std::vector<ScreenedCandidate> screened =
        screen(round, false, certainly_missing ? Candidates::attached_masses : Candidates::driven_masses);
    std::erase_if(screened,
                  [&](const ScreenedCandidate& s) { return !(s.hypothesis.train.objective < to_beat); });
    if (add_best_of(screened, round, false)) {
      converge(current_);
      const bool may_be_better = certainly_missing || has_certain_attached_mass();
      if (may_be_better && explains_more_than(without_attached_mass_->hypothesis)) return true;
    }
  } catch (...) {  // the search may end at any time: what was found before it counts
    give_up_attached_mass();
    throw;
  }
  give_up_attached_mass();
  return false;
}

/// A mass that begins each segment as it likes can account for a part of any noise, so plain simulations must
/// show it as well. Beside a strong disturbance they show little, also of a true one.
bool StepwiseSelection::explains_more_than(Hypothesis& other) {
  if (!(current_.train.objective < other.train.objective)) return false;
  if (is_driven_by_cart(current_.train.point.plant)) return true;
  const SimulationChange without = change_of_simulation(other, true);
  return without.segments == 0 || without.mean > without.limit(search_.policy());
}

bool StepwiseSelection::has_attached_mass() const {
  return std::any_of(found_.begin(), found_.end(), attaches_mass);
}

bool StepwiseSelection::has_certain_attached_mass() const {
  const double evidence = without_attached_mass_->hypothesis.train.objective - current_.train.objective;
  return is_driven_by_cart(current_.train.point.plant) && evidence > policy_.acceptance.overwhelming_evidence;
}

void StepwiseSelection::give_up_attached_mass() {
  current_ = std::move(without_attached_mass_->hypothesis);
  found_ = std::move(without_attached_mass_->found);
  record_step();
}

}  // namespace upright
