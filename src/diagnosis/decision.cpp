#include "decision.hpp"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

#include "candidates.hpp"

namespace upright {

namespace {

Decision accepted(Rule rule) {
  return {true, rule};
}
Decision rejected(Rule rule) {
  return {false, rule};
}
Decision waiting(MissingFit fit) {
  return {false, Rule::undecided, fit};
}

/// Fits whose evidence differs by less are equally good.
double equally_good(const SignificancePolicy& policy) {
  return evidence_at(policy.interval_z);
}

/// What is saved on training data beyond the price of the parameters.
double saving_of(const Evidence& e, const Improvement& improvement) {
  return improvement.train + e.penalty_saved - e.penalty;
}

/// What a few moments hold has a small t on the training runs. Held-out runs are a witness of their own,
/// whose evidence adds to its square, unless the training runs say no more than chance does.
double combined_t(const Improvement& improvement, const SelectionPolicy& p) {
  if (!(improvement.t_value > p.acceptance.chance_t)) return improvement.t_value;
  return std::sqrt(improvement.t_value * improvement.t_value + std::max(improvement.held, 0.0));
}

/// Whether training and held-out runs both speak for it, and together as clearly as training runs alone have
/// to: what is predicted of held-out runs counts as much.
bool is_borne_out(double saving, const Improvement& improvement, const SelectionPolicy& p) {
  return std::min(saving, improvement.held) > evidence_at(p.significance.noticeable_z) &&
         saving + improvement.held > p.acceptance.min_evidence;
}

/// Evidence on the training runs that only something missing can hold against: held-out runs may excite what
/// is missing still, and speak against a right effect until it is found too.
bool is_overwhelming(const Evidence& e, const SelectionPolicy& p) {
  return saving_of(e, e.improvement) > p.acceptance.overwhelming_evidence &&
         e.improvement.t_value > p.significance.noticeable_z;
}

/// Whether the data show an effect at all.
Decision decide_shown(const Evidence& e, const Improvement& improvement, const SelectionPolicy& p) {
  const double saving = saving_of(e, improvement);
  const double t = combined_t(improvement, p);
  if (is_borne_out(saving, improvement, p) && t > p.significance.noticeable_z)
    return accepted(Rule::borne_out);
  if (saving < p.acceptance.min_evidence) return rejected(Rule::too_little_evidence);
  // Held-out data that do not excite the effect say nothing.
  if (!(improvement.held > -equally_good(p.significance))) return rejected(Rule::held_out_against);
  if (t > p.significance.noticeable_z) return accepted(Rule::shown_throughout);
  if (saving > p.acceptance.overwhelming_evidence) return accepted(Rule::overwhelming);
  // Numbers of the plant that need not be so far off are no matter of noise.
  if (improvement.prior - e.penalty > p.acceptance.min_evidence) return accepted(Rule::plant_numbers);
  return rejected(Rule::chance);
}

/// Whether the size of an effect is certain. A fit that is less certain than its evidence says has not
/// arrived.
Decision decide_certain(const Evidence& e, const Improvement& improvement, const SelectionPolicy& p) {
  const auto enough = [&](double certainty) { return certainty >= p.significance.certain_z; };
  if (enough(e.certainty)) return accepted(Rule::shown_throughout);
  if (is_borne_out(saving_of(e, improvement), improvement, p)) {
    if (!e.certainty_of_all_runs) return waiting(MissingFit::all_runs);
    if (enough(*e.certainty_of_all_runs)) return accepted(Rule::borne_out);
  }
  if (improvement.train < evidence_at(p.significance.clear_ratio * std::max(e.certainty, 1.0)))
    return rejected(Rule::uncertain_size);
  if (!e.certainty_converged) return waiting(MissingFit::converged);
  return enough(*e.certainty_converged) ? accepted(Rule::shown_throughout) : rejected(Rule::uncertain_size);
}

/// The last question of a change that is accepted otherwise, by `rule`. Forces that look right a sample ahead
/// can simulate badly: then the name is wrong.
Decision decide_simulation(const Evidence& e, Rule rule, const SelectionPolicy& p) {
  if (!e.simulated_segments) return waiting(MissingFit::simulated_segments);
  const SimulationChange& change = *e.simulated_segments;
  if (change.segments == 0) return accepted(rule);
  return change.mean < change.limit(p) ? accepted(rule) : rejected(Rule::simulates_worse);
}

bool is_open(const Decision& decision) {
  return decision.waits_for != MissingFit::none;
}

Decision decide_addition(const Evidence& e, const SelectionPolicy& p) {
  if (!e.plausible) return rejected(Rule::cannot_be);
  if (e.bends_another) return rejected(Rule::bends_another);
  Decision shown = decide_shown(e, e.improvement, p);
  if (!shown.accepted) {
    if (!is_overwhelming(e, p)) return shown;
    const Decision certain = decide_certain(e, e.improvement, p);
    if (is_open(certain) || !certain.accepted) return certain;
    return rejected(Rule::held_out_in_doubt);
  }
  // A better estimate of the noise is not taken for an effect.
  if (e.with_low_noise || e.improvement.train < p.acceptance.overwhelming_evidence) {
    if (!e.at_equal_noise) return waiting(MissingFit::equal_noise);
    shown = decide_shown(e, *e.at_equal_noise, p);
    if (!shown.accepted) return shown;
  }
  if (!e.is_correction) {
    const Decision certain = decide_certain(e, e.at_equal_noise.value_or(e.improvement), p);
    if (!certain.accepted) return certain;
  }
  const Decision simulated = decide_simulation(e, shown.rule, p);
  const bool doubtful = simulated.rule == Rule::simulates_worse && is_overwhelming(e, p);
  return doubtful ? rejected(Rule::simulation_in_doubt) : simulated;
}

/// What stands in the place of another must be possible, certain, and simulate as well.
Decision decide_stand_in(const Evidence& e, Rule rule, const SelectionPolicy& p) {
  if (!e.plausible) return rejected(Rule::cannot_be);
  if (e.certainty < p.significance.certain_z) return rejected(Rule::uncertain_size);
  return decide_simulation(e, rule, p);
}

Decision decide_exchange(const Evidence& e, const SelectionPolicy& p) {
  const double saving = saving_of(e, e.improvement), held = e.improvement.held;
  const bool as_good = std::min({saving, held, saving + held}) > -equally_good(p.significance);
  const bool better = saving > evidence_at(p.significance.certain_z) && held > 0.0;
  if (!better && !(as_good && e.is_plainer)) return rejected(Rule::no_better);
  return decide_stand_in(e, better ? Rule::better : Rule::plainer, p);
}

Decision decide_simplification(const Evidence& e, const SelectionPolicy& p) {
  if (!(saving_of(e, e.improvement) > 0.0)) return rejected(Rule::no_better);
  if (!(e.improvement.held > -equally_good(p.significance))) return rejected(Rule::held_out_against);
  return decide_stand_in(e, Rule::plainer, p);
}

Decision decide_pair(const Evidence& e, const SelectionPolicy& p) {
  if (saving_of(e, e.improvement) < p.acceptance.min_evidence) return rejected(Rule::too_little_evidence);
  if (e.improvement.held < 0.0) return rejected(Rule::held_out_against);
  return decide_stand_in(e, Rule::better, p);
}

Decision decide_keeping(const Evidence& e, const SelectionPolicy& p) {
  if (saving_of(e, e.improvement) > p.acceptance.min_evidence &&
      e.improvement.t_value > p.significance.interval_z)
    return accepted(Rule::still_shown);
  const Decision shown = decide_shown(e, e.improvement, p);
  if (shown.accepted) return shown;
  // What does without it by becoming what cannot be does not do without it.
  return e.bends_another ? accepted(Rule::needed_by_another) : shown;
}

Decision decide_trust(const Evidence& e, const SelectionPolicy& p) {
  if (!(e.improvement.held > 0.0)) return rejected(Rule::held_out_against);
  return decide_simulation(e, Rule::held_out_agree, p);
}

}  // namespace

SimulationChange simulation_change(const std::vector<double>& before, const std::vector<double>& now) {
  const auto n = static_cast<double>(now.size());
  double mean = 0.0, square = 0.0;
  // Far beyond what noise and motion can be. A simulation that diverges has an infinite error.
  constexpr double smallest = 1e-9, largest = 1e9;
  for (std::size_t s = 0; s < now.size(); ++s) {
    const double change =
        std::log(std::clamp(now[s], smallest, largest) / std::clamp(before[s], smallest, largest));
    mean += change / n;
    square += change * change / n;
  }
  return {now.size(), mean, std::sqrt(std::max(square - mean * mean, 0.0))};
}

double SimulationChange::by_chance(const SelectionPolicy& p) const {
  if (segments == 0) return 0.0;
  const auto n = static_cast<double>(segments);
  const double usual = p.acceptance.usual_simulation_scatter;
  const double standard_error = std::sqrt((usual * usual / n + scatter * scatter) / n);
  return standard_error * quantile(boost::math::students_t(n), 1.0 - p.significance.level);
}

double SimulationChange::limit(const SelectionPolicy& p) const {
  return p.significance.visible_change + by_chance(p);
}

std::string_view name_of(Rule rule) {
  switch (rule) {
    case Rule::undecided:
      return "undecided";
    case Rule::shown_throughout:
      return "shown_throughout";
    case Rule::borne_out:
      return "borne_out";
    case Rule::overwhelming:
      return "overwhelming";
    case Rule::plant_numbers:
      return "plant_numbers";
    case Rule::better:
      return "better";
    case Rule::plainer:
      return "plainer";
    case Rule::still_shown:
      return "still_shown";
    case Rule::needed_by_another:
      return "needed_by_another";
    case Rule::held_out_agree:
      return "held_out_agree";
    case Rule::cannot_be:
      return "cannot_be";
    case Rule::bends_another:
      return "bends_another";
    case Rule::too_little_evidence:
      return "too_little_evidence";
    case Rule::held_out_against:
      return "held_out_against";
    case Rule::chance:
      return "chance";
    case Rule::uncertain_size:
      return "uncertain_size";
    case Rule::simulates_worse:
      return "simulates_worse";
    case Rule::no_better:
      return "no_better";
    case Rule::held_out_in_doubt:
      return "held_out_in_doubt";
    case Rule::simulation_in_doubt:
      return "simulation_in_doubt";
  }
  return "";
}

Decision decide(const Evidence& evidence, const SelectionPolicy& policy) {
  switch (evidence.change) {
    case Change::add:
      return decide_addition(evidence, policy);
    case Change::exchange:
      return decide_exchange(evidence, policy);
    case Change::simplify:
      return decide_simplification(evidence, policy);
    case Change::pair:
      return decide_pair(evidence, policy);
    case Change::keep:
      return decide_keeping(evidence, policy);
    case Change::trust_added:
      return decide_trust(evidence, policy);
  }
  return {};
}

bool is_out_of_reach(double lacks, double last_gain, int rounds_left) {
  return lacks > last_gain * rounds_left;
}

bool is_better_optimum(double fall, const SignificancePolicy& policy) {
  return fall > equally_good(policy);
}

std::size_t best_of(const std::vector<Contender>& contenders, const SignificancePolicy& policy) {
  double best = -std::numeric_limits<double>::infinity(), best_on_all = best;
  for (const Contender& c : contenders) best = std::max(best, c.score);
  const auto scores_equal = [&](const Contender& c) { return c.score > best - equally_good(policy); };
  for (const Contender& c : contenders)
    if (scores_equal(c)) best_on_all = std::max(best_on_all, c.score + c.held_out);
  std::size_t chosen = contenders.size();
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const Contender& c = contenders[i];
    const bool equal = scores_equal(c) && !(c.score + c.held_out < best_on_all - equally_good(policy));
    if (equal && (chosen == contenders.size() || is_plainer(c.effect, contenders[chosen].effect))) chosen = i;
  }
  return chosen;
}

}  // namespace upright
