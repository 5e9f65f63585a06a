// The part of the selection that leads an exploration of thinned data and judges what it found.
#include <algorithm>
#include <cmath>

#include "stepwise_selection.hpp"

namespace upright {

void StepwiseSelection::explore_with(StepwiseSelection& explorer, double sample_ratio) {
  explorer_ = &explorer;
  sample_ratio_ = sample_ratio;
}

std::vector<std::size_t> StepwiseSelection::possible_candidates(
    const std::vector<std::size_t>& candidates) const {
  if (limits_.empty()) return candidates;
  const double least = budget_.min_screening_evidence_share * policy_.acceptance.min_evidence;
  std::vector<std::size_t> possible;
  for (const std::size_t effect : candidates) {
    const auto limit = limits_.find(effect);
    if (limit == limits_.end() || !(limit->second < least)) possible.push_back(effect);
  }
  return possible;
}

void StepwiseSelection::lead_explorer() {
  StepwiseSelection& e = *explorer_;
  e.given_ = e.search_.refitted(given_);
  e.current_ = found_.empty() ? e.given_ : e.search_.refitted(current_);
  e.found_ = found_;
  e.withdrawn_ = withdrawn_;
  e.where_ = where_;
  e.similar_effects_ = similar_effects_;
  e.last_gains_.clear();
}

int StepwiseSelection::explore(int first_round, int last_round, bool with_low_noise) {
  limits_.clear();
  lead_explorer();
  explorer_->select_forward(first_round, last_round, with_low_noise);
  contradicted_ = contradicted_ || explorer_->contradicted_;
  take_account();
  const std::size_t before = found_.size();
  if (explorer_->found_ != found_ && !adopt(with_low_noise)) return first_round;
  // So many times as many samples say at most so many times as much.
  const double share = explorer_->search_.screening_share();
  for (const auto& [effect, gain] : explorer_->last_gains_)
    limits_[effect] = sample_ratio_ * (gain + penalty_of(effect)) / share - penalty_of(effect);
  const int added = static_cast<int>(found_.size()) - static_cast<int>(before);
  return std::min(first_round + std::max(added, 0), last_round - 1);
}

bool StepwiseSelection::adopt(bool with_low_noise) {
  StepwiseSelection& e = *explorer_;
  std::vector<std::size_t> brought;
  for (const std::size_t effect : e.found_)
    if (!is_found(effect)) brought.push_back(effect);
  if (brought.empty()) return false;
  options_.tell(0.7, "fitting what was found to all samples");
  const bool one_more = brought.size() == 1 && e.found_.size() == found_.size() + 1;
  Hypothesis h = e.current_;
  search_.refine(current_, h);
  Evidence evidence = evidence_of(one_more ? Change::add : Change::pair, current_, h, brought);
  evidence.penalty = one_more ? penalty_of(brought.front()) : penalty_of_change(current_, h);
  evidence.bends_another = one_more && bends_another(h, brought.front(), &Search::is_admissible);
  evidence.is_correction = one_more && current_.train.point.plant.find(brought.front()) != nullptr;
  evidence.with_low_noise = with_low_noise;
  const Decision decision = decided(evidence, h, brought.front());
  if (!decision.accepted && !decision.in_doubt()) {
    e.found_ = found_;
    return false;
  }
  if (decision.in_doubt() && !checkpoint_) checkpoint_.emplace(Checkpoint{current_, found_});
  where_ = e.where_;
  similar_effects_ = e.similar_effects_;
  current_ = std::move(h);
  found_ = e.found_;
  record_step();
  return true;
}

void StepwiseSelection::adopt_unfinished() {
  if (&latest() == this) return;
  take_account();
  adopt(false);
}

const StepwiseSelection& StepwiseSelection::latest() const {
  return explorer_ != nullptr && explorer_->found_.size() > found_.size() ? *explorer_ : *this;
}

void StepwiseSelection::take_account() {
  StepwiseSelection& e = *explorer_;
  for (const CandidateScore& candidate : e.record_.candidates)
    note_candidate(candidate.effect, candidate.evidence);
  record_.trials.insert(record_.trials.end(), e.record_.trials.begin(), e.record_.trials.end());
  for (auto& [effect, h] : e.finalists_) {
    finalists_.emplace_back(effect, std::move(h));
    finalist_evidence_[effect] = e.finalist_evidence_.at(effect);
  }
  resembling_.insert(resembling_.end(), e.resembling_.begin(), e.resembling_.end());
  e.record_.candidates.clear();
  e.record_.trials.clear();
  e.finalists_.clear();
  e.resembling_.clear();
}

void StepwiseSelection::note_candidate(std::size_t effect, double gain) {
  std::erase_if(record_.candidates, [&](const CandidateScore& c) { return c.effect == effect; });
  record_.candidates.push_back({effect, 0.0, std::max(gain, 0.0)});
}

}  // namespace upright
