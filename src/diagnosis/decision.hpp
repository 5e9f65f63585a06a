// Whether the data bear out a change of the model: a pure function of what fits have shown. It makes no fit;
// where a rule asks for one that was not made yet, the decision says which, and waits for it.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "selection_policy.hpp"

namespace upright {

/// How much better one hypothesis is than another, robust to residuals that are not white: sums over blocks
/// of a quarter of a second.
struct Improvement {
  double train = 0.0;    ///< fall of the objective on training data
  double prior = 0.0;    ///< of that, what is believed of the parameters: they need not go so far from it
  double held = 0.0;     ///< of the negative log predictive density of held-out data
  double t_value = 0.0;  ///< of the mean fall per quarter of a second of training data
};

/// How much further off plain simulations of held-out segments are: logarithms of ratios, over the segments.
struct SimulationChange {
  std::size_t segments = 0;  ///< 0 where no data are held out
  double mean = 0.0, scatter = 0.0;
  /// By how much the mean may be larger than its true value. A few segments say little of their scatter, so
  /// the usual one counts as one more of them (Student's t, with a scaled inverse chi-square prior).
  double by_chance(const SelectionPolicy& policy) const;
  /// The mean above which simulations count as worse.
  double limit(const SelectionPolicy& policy) const;
};

/// From the errors of the same segments before and now [any unit, one for both]. They may be infinite.
SimulationChange simulation_change(const std::vector<double>& before, const std::vector<double>& now);

/// What is to be decided.
enum class Change {
  add,         ///< an effect to the model
  exchange,    ///< what was found for what resembled it
  simplify,    ///< what was found into plainer words
  pair,        ///< two effects for what was found of them
  keep,        ///< what was found earlier, beside the others
  trust_added  ///< what was added while held-out runs spoke against it
};

/// What the data say of a change. Improvements are over the model without it.
struct Evidence {
  Change change = Change::add;
  Improvement improvement;
  double penalty = 0.0;         ///< of the parameters beyond the first that it brings [evidence]
  double penalty_saved = 0.0;   ///< of those that go [evidence]
  double certainty = 0.0;       ///< of the size of what it brings, the least [standard errors]
  bool plausible = true;        ///< no size at the end of its range, none that does nothing
  bool bends_another = false;   ///< another effect that was found becomes what cannot be
  bool is_correction = false;   ///< of a number of the plant file
  bool with_low_noise = false;  ///< found from less noise than the model without it has
  bool is_plainer = false;      ///< than what goes

  // From fits that only some rules ask for.
  std::optional<Improvement> at_equal_noise;  ///< over the model from the same noise
  std::optional<SimulationChange> simulated_segments;
  std::optional<double> certainty_of_all_runs;
  std::optional<double> certainty_converged;  ///< once more fits gain nothing
};

/// A fit that a decision waits for.
enum class MissingFit { none, equal_noise, simulated_segments, all_runs, converged };

/// Why a change was accepted, or why not.
enum class Rule {
  undecided,
  // Accepted.
  shown_throughout,   ///< evidence on the training runs, all along them
  borne_out,          ///< training and held-out runs both say so
  overwhelming,       ///< evidence that no coloured noise makes
  plant_numbers,      ///< numbers of the plant need not be so far off
  better,             ///< than what it stands for
  plainer,            ///< as good, and fewer words
  still_shown,        ///< beside the others
  needed_by_another,  ///< without it another becomes what cannot be
  held_out_agree,     ///< in the end
  // Not accepted.
  cannot_be,
  bends_another,
  too_little_evidence,
  held_out_against,
  chance,
  uncertain_size,
  simulates_worse,
  no_better,
  // Not accepted, but followed where nothing is: held-out runs may speak against a right effect until what
  // else is missing is found.
  held_out_in_doubt,
  simulation_in_doubt
};
std::string_view name_of(Rule rule);

struct Decision {
  bool accepted = false;
  Rule rule = Rule::undecided;
  MissingFit waits_for = MissingFit::none;
  bool in_doubt() const { return rule == Rule::held_out_in_doubt || rule == Rule::simulation_in_doubt; }
};

Decision decide(const Evidence& evidence, const SelectionPolicy& policy);

/// Whether a search without one effect is given up: it still lacks so much evidence, and would not make up
/// for it if each of the rounds that are left gained what the last one did.
bool is_out_of_reach(double lacks, double last_gain, int rounds_left);

/// Whether a fit from elsewhere, whose objective is lower by `fall`, is in a better place.
bool is_better_optimum(double fall, const SignificancePolicy& policy);

/// An effect that may be taken.
struct Contender {
  std::size_t effect = 0;
  double score = 0.0;     ///< what it saves on training data beyond its price [evidence]
  double held_out = 0.0;  ///< what it saves there [evidence]
};

/// The place of the one with the largest score. Scores that are equal leave it to the held-out runs, and
/// where those say the same, to the plainer effect. There must be one.
std::size_t best_of(const std::vector<Contender>& contenders, const SignificancePolicy& policy);

}  // namespace upright
