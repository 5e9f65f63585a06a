#include "stepwise_selection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>

#include "estimation/attached_start.hpp"
#include "residual_location.hpp"
#include "upright/base/error.hpp"

namespace upright {

StepwiseSelection::StepwiseSelection(Search& search, const DiagnosisOptions& options, Diagnosis& record)
    : search_(search),
      policy_(search.policy()),
      budget_(search.budget()),
      options_(options),
      record_(record) {}

void StepwiseSelection::begin() {
  options_.report_progress(0.02, "fitting the model as given");
  given_ = search_.baseline();
  if (!std::isfinite(given_.train.objective))
    throw ConfigError("the model cannot be simulated with these runs: check the plant file");
  current_ = given_;
}

void StepwiseSelection::find() {
  select_forward(0, budget_.max_rounds, false, {});
  try_pairs(finalists_);
  eliminate_backward();
}

bool StepwiseSelection::renew_initial_states() {
  options_.report_progress(0.83, "fitting again from new initial states");
  Hypothesis h = search_.with_new_initial_states(current_);
  if (!is_better_optimum(current_.train.objective - h.train.objective, policy_.significance)) return false;
  current_ = std::move(h);
  return true;
}

bool StepwiseSelection::find_thoroughly(bool certainly_missing) {
  const std::vector<std::size_t> before = found_;
  const double objective = current_.train.objective;
  if (certainly_missing) select_forward(budget_.max_rounds, 2 * budget_.max_rounds, true, {});
  const double share = search_.screening_share();
  if (share < 1.0) {
    const int first_round = 2 * budget_.max_rounds, last_round = 3 * budget_.max_rounds;
    // A limit that only a few data reach may not have shown on a part of them.
    const bool limit_is_open = search_.screen_on_largest_voltage();
    const Candidates first = limit_is_open ? Candidates::usual : Candidates::best_of_last_round;
    // What certainly is missing shows on a part of many data too, but for such a limit.
    const bool on_all = !certainly_missing || share >= budget_.certain_screening_share;
    if (on_all) search_.screen_on_all();
    if (on_all || limit_is_open) select_forward(first_round, last_round, false, {}, first);
  }
  // On the way a better place may have been found for the noise alone.
  if (found_ == before) return is_better_optimum(objective - current_.train.objective, policy_.significance);
  eliminate_backward();
  return true;
}

std::vector<std::size_t> StepwiseSelection::withdraw(std::size_t effect) {
  std::vector<std::size_t> gone = {effect};
  if (is_found(effect)) {
    Hypothesis h = search_.without(current_, effect);
    for (auto other = found_.rbegin(); other != found_.rend() && !std::isfinite(h.train.objective); ++other) {
      if (*other == effect) continue;
      const Hypothesis independent = search_.without(current_, *other);
      if (!std::isfinite(independent.train.objective)) continue;
      h = search_.without(independent, effect);
      gone = {effect, *other};
    }
    current_ = std::move(h);
    std::erase_if(found_,
                  [&](std::size_t of) { return std::find(gone.begin(), gone.end(), of) != gone.end(); });
    record_step();
  }
  withdrawn_.insert(gone.begin(), gone.end());
  return gone;
}

void StepwiseSelection::hold(std::size_t number) {
  search_.hold(number);
  withdrawn_.insert(number);
  current_ = search_.with_held_numbers(current_);
}

std::vector<std::size_t> StepwiseSelection::open_candidates(Candidates which) const {
  const bool usual = which != Candidates::attached_masses && which != Candidates::driven_masses;
  std::vector<std::size_t> candidates =
      (usual ? candidate_effects : attached_mass_candidates)(current_.train.point.plant, search_.range());
  for (const std::size_t effect : search_.nuisances())
    if (usual && !current_.added.contains(effect)) candidates.push_back(effect);
  std::erase_if(candidates, [&](std::size_t effect) { return withdrawn_.contains(effect); });
  if (which == Candidates::driven_masses)
    std::erase_if(candidates, [](std::size_t effect) { return !is_driven_by_cart(effect); });
  if (which == Candidates::best_of_last_round)
    std::erase_if(candidates, [&](std::size_t effect) { return !best_of_last_round_.contains(effect); });
  return candidates;
}

std::vector<StepwiseSelection::Candidate> StepwiseSelection::promising_candidates(
    const Hypothesis& from, const std::vector<std::size_t>& candidates, int round) {
  std::vector<Prediction> predicted = search_.predictions(from, candidates);
  std::vector<std::size_t> ranking(candidates.size());
  std::iota(ranking.begin(), ranking.end(), std::size_t{0});
  std::stable_sort(ranking.begin(), ranking.end(),
                   [&](std::size_t a, std::size_t b) { return predicted[a].gain > predicted[b].gain; });
  double best = 0.0;
  for (const Prediction& of : predicted)
    if (std::isfinite(of.gain)) best = std::max(best, of.gain);
  std::vector<Candidate> chosen;
  std::size_t kept = 0;
  for (const std::size_t i : ranking) {
    const double gain = predicted[i].gain;
    const bool unknown = !std::isfinite(gain);
    const bool is_high = kept < budget_.min_screened || gain > budget_.predicted_gain_share * best;
    if (unknown || (is_high && gain > least_predicted_gain())) {
      chosen.push_back({candidates[i], std::move(predicted[i].starts)});
      kept += unknown ? 0 : 1;
    } else {
      if (round == 0) note_candidate(candidates[i], gain);
    }
  }
  return chosen;
}

double StepwiseSelection::least_predicted_gain() const {
  return budget_.predicted_gain_share * policy_.acceptance.min_evidence * search_.screening_share();
}

double StepwiseSelection::least_screened_gain() const {
  return budget_.min_screening_evidence_share * policy_.acceptance.min_evidence * search_.screening_share();
}

void StepwiseSelection::note_candidate(std::size_t effect, double gain) {
  std::erase_if(record_.candidates, [&](const CandidateScore& c) { return c.effect == effect; });
  record_.candidates.push_back({effect, 0.0, std::max(gain, 0.0)});
}

double StepwiseSelection::penalty_of(std::size_t effect) const {
  return policy_.acceptance.parameter_penalty *
         static_cast<double>(effect_registry()[effect].parameters.size() - 1);
}

double StepwiseSelection::penalty_of_change(const Hypothesis& from, const Hypothesis& to) const {
  return policy_.acceptance.parameter_penalty *
         (static_cast<double>(to.free.size()) - static_cast<double>(from.free.size()));
}

Evidence StepwiseSelection::evidence_of(Change change, const Hypothesis& from, const Hypothesis& to,
                                        const std::vector<std::size_t>& brought) const {
  Evidence e;
  e.change = change;
  // One effect more, or less, has a t value over blocks too, which a residual that lasts does not raise.
  const bool has_t_value = change == Change::add || change == Change::keep;
  e.improvement = has_t_value ? compare(from, to, 1.0) : compare(from, to);
  if (!std::isfinite(to.train.objective)) return e;
  e.certainty = std::numeric_limits<double>::infinity();
  for (const std::size_t effect : brought) {
    e.certainty = std::min(e.certainty, search_.certainty(to, effect));
    e.plausible = e.plausible && search_.is_plausible(to, effect);
  }
  return e;
}

Decision StepwiseSelection::decided(Evidence& e, Hypothesis& h, std::size_t effect) {
  for (;;) {
    const Decision decision = decide(e, policy_);
    switch (decision.waits_for) {
      case MissingFit::none:
        return decision;
      case MissingFit::equal_noise:
        equalise_noise(h);
        e.at_equal_noise = compare(current_, h, 1.0);
        break;
      case MissingFit::simulated_segments:
        // What stands in the place of something else is compared where both were fitted, too.
        e.simulated_segments = change_of_simulation(h, e.change == Change::pair);
        break;
      case MissingFit::all_runs:
        e.certainty_of_all_runs = search_.certainty(search_.fitted_to_all_runs(h), effect);
        break;
      case MissingFit::converged:
        converge(h);
        e.certainty_converged = search_.certainty(h, effect);
        break;
    }
  }
}

void StepwiseSelection::converge(Hypothesis& h) {
  for (int refit = 0; refit < budget_.max_refits; ++refit) {
    Hypothesis further = h;
    search_.refine(h, further);
    const double gain = h.train.objective - further.train.objective;
    if (gain > 0.0) h = std::move(further);
    if (!(gain > budget_.min_refit_gain)) break;
  }
}

SimulationChange StepwiseSelection::change_of_simulation(Hypothesis& h, bool of_training_too) {
  if (search_.held_data().segments.empty()) return {};
  std::vector<double> before = search_.simulate(current_).segment_gap;
  std::vector<double> now = search_.simulate(h).segment_gap;
  if (found_.empty()) given_.simulation = current_.simulation;
  if (of_training_too) {
    const std::vector<double>& training_before = search_.simulate_training(current_);
    const std::vector<double>& training_now = search_.simulate_training(h);
    before.insert(before.end(), training_before.begin(), training_before.end());
    now.insert(now.end(), training_now.begin(), training_now.end());
  }
  return simulation_change(before, now);
}

void StepwiseSelection::resolve_doubt() {
  if (!checkpoint_) return;
  // What stood before is the answer until the held-out runs are on the side of what was added.
  Checkpoint added = std::move(*checkpoint_);
  checkpoint_.reset();
  std::swap(current_, added.hypothesis);
  std::swap(found_, added.found);
  Evidence e = evidence_of(Change::trust_added, current_, added.hypothesis, {});
  if (decided(e, added.hypothesis, 0).accepted) {
    current_ = std::move(added.hypothesis);
    found_ = std::move(added.found);
  } else {
    contradicted_ = true;
    record_step();
  }
}

void StepwiseSelection::equalise_noise(const Hypothesis& richer) {
  Hypothesis again = current_;
  again.train.point.noise = richer.train.point.noise;
  search_.refine(again, again);
  if (again.train.objective < current_.train.objective) current_ = std::move(again);
}

std::string StepwiseSelection::locate(const Hypothesis& h) const {
  const FitData& train = search_.train_data();
  const ResidualLocation place = locate_residual(train, h.train.point, policy_);
  std::size_t worst = 0;
  double largest = 0.0;
  for (std::size_t s = 0; s < h.train.segment_chi_square.size(); ++s) {
    const double mean = h.train.segment_chi_square[s] / std::max(h.train.segment_samples[s], 1.0);
    if (mean <= largest) continue;
    largest = mean;
    worst = s;
  }
  const Segment& segment = train.segments[worst];
  const Measurement& run = (*train.runs)[segment.run];
  std::ostringstream text;
  text.precision(3);
  if (place.depends_on.empty())
    text << "the residual does not depend on any measured quantity";
  else
    text << "in the " << (place.in_pendulum ? "pendulum" : "cart") << " equation: the residual "
         << (place.in_pendulum ? "torque" : "force") << " goes with " << place.depends_on << " ("
         << std::lround(100.0 * place.share) << " percent of it can be predicted)";
  text << "; the worst stretch is " << run.name << " from " << run.time_s[segment.first] << " to "
       << run.time_s[segment.last] << " s";
  return text.str();
}

void StepwiseSelection::record_trial(int round, std::size_t effect, const Hypothesis& h,
                                     const Improvement& improvement) {
  Trial trial;
  trial.round = static_cast<std::size_t>(round);
  trial.effect = effect;
  trial.evidence = improvement.train;
  trial.held = improvement.held;
  trial.t_value = improvement.t_value;
  trial.certainty = search_.certainty(h, effect);
  trial.noise = h.train.point.noise;
  trial.dispersion = h.train.dispersion;
  if (std::isfinite(h.train.objective)) trial.parameters = estimates_of(effect, h);
  record_.trials.push_back(trial);
}

void StepwiseSelection::record_step() {
  Step step;
  for (const std::size_t effect : found_) step.effects.push_back({effect, estimates_of(effect, current_)});
  record_.steps.push_back(std::move(step));
}

void StepwiseSelection::select_forward(int first_round, int last_round, bool with_low_noise, const Goal& goal,
                                       Candidates first) {
  double before = current_.train.objective;
  for (int round = first_round; round < last_round; ++round) {
    const int rounds_left = last_round - round - 1;
    const Candidates which = round == first_round ? first : Candidates::usual;
    const std::vector<ScreenedCandidate> screened = screen(round, with_low_noise, which);
    if (is_out_of_reach_of(screened, goal, rounds_left)) break;
    if (!add_best_of(screened, round, with_low_noise)) break;
    const double reached = current_.train.objective;
    if (is_out_of_reach(reached - goal.objective, before - reached, rounds_left)) break;
    before = reached;
  }
  resolve_doubt();
}

double StepwiseSelection::share_done(int round) {
  return std::min(0.05 + 0.2 * round, 0.7);
}

bool StepwiseSelection::add_best_of(const std::vector<ScreenedCandidate>& screened, int round,
                                    bool with_low_noise) {
  const double done = share_done(round);
  std::vector<Finalist> accepted = fit_finalists(round, screened, with_low_noise, done);
  if (accepted.empty()) return false;
  take(round, accepted[choose(accepted)], screened);
  while (exchange() || simplify()) {
  }
  return true;
}

std::vector<StepwiseSelection::ScreenedCandidate> StepwiseSelection::screen(int round, bool with_low_noise,
                                                                            Candidates which) {
  const double done = share_done(round);
  options_.report_progress(done, "ranking the candidates");
  Hypothesis from = current_;
  if (with_low_noise) from.train.point.noise = reduced_process_noise(from.train.point.noise);
  const std::vector<Candidate> candidates = promising_candidates(from, open_candidates(which), round);
  Hypothesis reference = search_.descended_on_subset(from);
  // What hardly gains with the noise as it is gains no more from other noise.
  const double to_reach = reference.train.objective - least_predicted_gain();
  search_.renew_noise_on_subset(reference);
  std::vector<ScreenedCandidate> screened;
  double tried = 0.0;
  for (const auto& [effect, starts] : candidates) {
    const double share = tried++ / static_cast<double>(candidates.size());
    options_.report_progress(done + 0.02 + 0.1 * share, "trying " + kind_of(effect));
    Hypothesis h = search_.screened(from, effect, starts, to_reach);
    const bool failed = !std::isfinite(h.train.objective);
    const double gain = failed ? 0.0 : reference.train.objective - h.train.objective - penalty_of(effect);
    if (round == 0) note_candidate(effect, gain);
    if (!failed) screened.push_back({effect, std::move(h), gain});
  }
  if (which == Candidates::usual) {
    best_of_last_round_.clear();
    for (const ScreenedCandidate* s : by_gain(screened))
      if (best_of_last_round_.size() < budget_.min_screened) best_of_last_round_.insert(s->effect);
  }
  return screened;
}

std::vector<const StepwiseSelection::ScreenedCandidate*> StepwiseSelection::by_gain(
    const std::vector<ScreenedCandidate>& screened) {
  std::vector<const ScreenedCandidate*> ranking;
  ranking.reserve(screened.size());
  for (const ScreenedCandidate& s : screened) ranking.push_back(&s);
  std::stable_sort(ranking.begin(), ranking.end(),
                   [](const ScreenedCandidate* a, const ScreenedCandidate* b) { return a->gain > b->gain; });
  return ranking;
}

std::vector<StepwiseSelection::Finalist> StepwiseSelection::fit_finalists(
    int round, const std::vector<ScreenedCandidate>& screened, bool with_low_noise, double done) {
  std::vector<const ScreenedCandidate*> ranking = by_gain(screened);
  constexpr double rounding = 0.01;  // [evidence] by which two names of one force differ
  for (std::size_t i = 1; i < ranking.size(); ++i)
    if (is_plainer_name(ranking[i]->effect, ranking[i - 1]->effect) &&
        ranking[i - 1]->gain < ranking[i]->gain + rounding)
      std::swap(ranking[i], ranking[i - 1]);
  if (round == 0)
    for (const ScreenedCandidate* s : ranking)
      if (resembling_.size() < budget_.max_resembling &&
          s->gain > budget_.resembling_share * ranking[0]->gain)
        resembling_.emplace_back(s->effect, s->hypothesis);
  std::vector<Finalist> accepted, doubtful;
  for (std::size_t place = 0; place < std::min(budget_.max_finalists, ranking.size()); ++place) {
    const ScreenedCandidate& finalist = *ranking[place];
    if (finalist.gain < std::max(least_screened_gain(), budget_.min_gain_share * ranking[0]->gain)) break;
    // Neither similar to the best one nor next best.
    if (!accepted.empty() && finalist.gain < budget_.resembling_share * ranking[0]->gain) break;
    options_.report_progress(
        done + 0.12 + 0.08 * static_cast<double>(place) / static_cast<double>(budget_.max_finalists),
        "fitting " + kind_of(finalist.effect));
    Finalist fitted{finalist.effect, finalist.hypothesis, 0.0};
    const Decision decision = try_finalist(round, with_low_noise, fitted);
    if (decision.accepted)
      accepted.push_back(std::move(fitted));
    else if (decision.in_doubt())
      doubtful.push_back(std::move(fitted));
  }
  if (!accepted.empty() || doubtful.empty()) return accepted;
  if (!checkpoint_) checkpoint_.emplace(Checkpoint{current_, found_});
  return doubtful;
}

Decision StepwiseSelection::try_finalist(int round, bool with_low_noise, Finalist& finalist) {
  const std::size_t effect = finalist.effect;
  Hypothesis& h = finalist.hypothesis;
  search_.refine(current_, h);
  if (round == 0) search_.simulate(h);
  if (round == 0) {
    std::erase_if(finalists_, [&](const auto& earlier) { return earlier.first == finalist.effect; });
    finalists_.emplace_back(effect, h);
  }
  if (round == 0) finalist_evidence_[effect] = compare(given_, h, 1.0).train;
  Evidence e = evidence_of(Change::add, current_, h, {effect});
  e.penalty = penalty_of(effect);
  e.bends_another = bends_another(h, effect, &Search::is_admissible);
  e.is_correction = current_.train.point.plant.find(effect) != nullptr;
  e.with_low_noise = with_low_noise;
  record_trial(round, effect, h, e.improvement);
  const Decision decision = decided(e, h, effect);
  record_.trials.back().rule = name_of(decision.rule);
  const bool as_first_seen = decision.rule == Rule::held_out_in_doubt;
  finalist.score = (as_first_seen ? e.improvement : compare(current_, h, 1.0)).train - penalty_of(effect);
  return decision;
}

std::size_t StepwiseSelection::choose(std::vector<Finalist>& accepted) {
  const auto largest = [&] {
    double score = -std::numeric_limits<double>::infinity();
    for (const Finalist& b : accepted) score = std::max(score, b.score);
    return score;
  };
  const double to_reach = (1.0 - budget_.close_score_share) * largest();
  if (std::count_if(accepted.begin(), accepted.end(), [&](const Finalist& b) { return b.score > to_reach; }) >
      1)
    for (Finalist& b : accepted) {
      if (b.score <= to_reach) continue;
      options_.report_progress(0.8, "completing the fit of " + kind_of(b.effect));
      Hypothesis further = b.hypothesis;
      search_.refine(b.hypothesis, further);
      const double gain = b.hypothesis.train.objective - further.train.objective;
      if (!(gain > 0.0)) continue;
      b.hypothesis = std::move(further);
      b.score += gain;
    }
  std::vector<Contender> contenders;
  contenders.reserve(accepted.size());
  for (const Finalist& b : accepted)
    contenders.push_back({b.effect, b.score, compare(current_, b.hypothesis, 1.0).held});
  return best_of(contenders, policy_.significance);
}

void StepwiseSelection::take(int round, Finalist& best, const std::vector<ScreenedCandidate>& screened) {
  const std::size_t effect = best.effect;
  where_[effect] = locate(current_);
  for (Trial& trial : record_.trials)
    if (trial.round == static_cast<std::size_t>(round) && trial.effect == effect) trial.taken = true;
  current_ = std::move(best.hypothesis);
  found_.push_back(effect);
  const auto winner = std::find_if(screened.begin(), screened.end(),
                                   [&](const ScreenedCandidate& s) { return s.effect == effect; });
  for (const ScreenedCandidate& s : screened)
    if (s.effect != effect &&
        (s.gain > budget_.resembling_share * winner->gain || is_contained_in(s.effect, effect)))
      similar_effects_[effect].push_back(s.effect);
  record_step();
}

bool StepwiseSelection::is_contained_in(std::size_t part, std::size_t effect) {
  return kind_of(part) == "coulomb_friction" &&
         (kind_of(effect) == "friction_asymmetry" || kind_of(effect) == "stribeck_friction");
}

bool StepwiseSelection::exchange() {
  for (std::size_t i = 0; i + 1 < found_.size(); ++i) {
    const std::size_t effect = found_[i];
    std::vector<std::size_t> others;
    for (const std::size_t other : similar_effects_[effect])
      if (!is_found(other) && !withdrawn_.contains(other) && !exchanged_.contains({effect, other}))
        others.push_back(other);
    if (others.empty()) continue;
    options_.report_progress(0.8, "looking for a replacement of " + kind_of(effect));
    const Hypothesis without = search_.without(current_, effect);
    if (!std::isfinite(without.train.objective)) continue;
    const double to_beat = search_.on_screening_subset(current_).train.objective - penalty_of(effect);
    const double worth = search_.on_screening_subset(without).train.objective - to_beat;
    for (const std::size_t other : others) {
      // The rest of the force may be found later, as another effect.
      if (!is_contained_in(other, effect)) exchanged_.insert({effect, other});
      Hypothesis h = search_.screened(without, other);
      // What was found beside the one is of the wrong size for the other: the way is longer than a few steps.
      if (h.train.objective + penalty_of(other) < to_beat + budget_.exchange_share * worth)
        search_.converge_on_subset(h);
      if (!(h.train.objective + penalty_of(other) < to_beat + evidence_at(policy_.significance.certain_z)))
        continue;
      search_.refine(without, h);
      Evidence e = evidence_of(Change::exchange, current_, h, {other});
      e.penalty = penalty_of(other);
      e.penalty_saved = penalty_of(effect);
      e.is_plainer = is_plainer(other, effect);
      if (!decided(e, h, other).accepted) continue;
      where_[other] = where_.at(effect);
      similar_effects_[other] = similar_effects_[effect];
      similar_effects_[other].push_back(effect);
      current_ = std::move(h);
      found_[i] = other;
      record_step();
      return true;
    }
  }
  return false;
}

std::vector<StepwiseSelection::Simpler> StepwiseSelection::simpler_forms() const {
  const std::size_t one_way = effect_number("friction_asymmetry"), spring = effect_number("cable_spring");
  const std::size_t level = effect_number("coulomb_friction"), force = effect_number("constant_force");
  const Plant& plant = current_.train.point.plant;
  const auto is_new = [&](std::size_t effect) { return is_found(effect) && !search_.is_nuisance(effect); };
  std::vector<Simpler> forms;
  if (plant.find(force) != nullptr) return forms;
  if (is_new(one_way) && plant.find(level) == nullptr) {
    const double size = plant.find(one_way)->values[0];
    forms.push_back({one_way, {{level, {0.5 * std::abs(size)}}, {force, {-0.5 * size}}}});
  }
  if (is_new(spring)) {
    const double stiffness = plant.find(spring)->values[0], center_m = plant.find(spring)->values[1];
    const DataRange& range = search_.range();
    const double off_m = center_m - range.cart_mean_m;
    if (std::abs(off_m) > range.cart_high_m - range.cart_low_m)
      forms.push_back({spring, {{force, {stiffness * off_m}}}});
  }
  return forms;
}

bool StepwiseSelection::simplify() {
  for (const Simpler& form : simpler_forms()) {
    if (std::any_of(form.others.begin(), form.others.end(),
                    [&](const PlantEffect& other) { return withdrawn_.contains(other.number); }))
      continue;
    if (!simplified_.insert({form.effect, found_.size()}).second) continue;
    options_.report_progress(0.8, "trying to simplify " + kind_of(form.effect));
    Hypothesis h = search_.exchanged(current_, form.effect, form.others);
    std::vector<std::size_t> brought;
    for (const PlantEffect& other : form.others) brought.push_back(other.number);
    Evidence e = evidence_of(Change::simplify, current_, h, brought);
    e.penalty = penalty_of_change(current_, h);
    if (!decided(e, h, brought.front()).accepted) continue;
    current_ = std::move(h);
    auto place = found_.erase(std::find(found_.begin(), found_.end(), form.effect));
    for (const PlantEffect& other : form.others) {
      where_[other.number] = where_.at(form.effect);
      similar_effects_[other.number] = similar_effects_[form.effect];
      place = std::next(found_.insert(place, other.number));
    }
    record_step();
    return true;
  }
  return false;
}

void StepwiseSelection::eliminate_backward() {
  bool again = found_.size() > 1;
  while (again) {
    again = false;
    for (std::size_t i = 0; i < found_.size(); ++i) {
      options_.report_progress(0.85, "checking whether " + kind_of(found_[i]) + " is needed");
      Hypothesis h = search_.without(current_, found_[i]);
      if (!std::isfinite(h.train.objective)) continue;
      Evidence e = evidence_of(Change::keep, h, current_, {});
      e.penalty = penalty_of(found_[i]);
      e.bends_another = bends_another(h, found_[i], &Search::is_plausible);
      if (decided(e, current_, found_[i]).accepted) continue;
      current_ = std::move(h);
      found_.erase(found_.begin() + static_cast<std::ptrdiff_t>(i));
      record_step();
      again = found_.size() > 1;
      break;
    }
  }
}

bool StepwiseSelection::bends_another(const Hypothesis& h, std::size_t effect, Search::Holds holds) const {
  std::vector<std::size_t> others = found_;
  std::erase(others, effect);
  return search_.bends_one_of(others, current_, h, holds);
}

bool StepwiseSelection::is_found(std::size_t effect) const {
  return std::find(found_.begin(), found_.end(), effect) != found_.end();
}

}  // namespace upright
