// The search for missing effects: nested fits, forward by evidence, then backward deletion.
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "candidates.hpp"
#include "decision.hpp"
#include "effect_starts.hpp"
#include "estimation/fit.hpp"
#include "search_budget.hpp"
#include "selection_policy.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

/// A plain simulation of held-out data, in units of the sensors' noise.
struct FreeRunSimulation {
  double gap = 0.0;                 ///< root mean square of all that is off
  std::vector<double> segment_gap;  ///< the same, by segment
};

/// A set of effects fitted to the training data and judged on held-out data.
struct Hypothesis {
  std::set<std::size_t> added;  ///< effects freed beyond what the plant file says
  FitResult train;
  FitResult held;  ///< initial states only, plant and noise from `train`
  double negative_log_predictive_density =
      0.0;  ///< of the held-out data: minus twice the log of their likelihood, with noise of
            ///< their own, averaged over what the training data leave open of the parameters;
            ///< not of what `fitted_separately` and `fitted_to_all_runs` made
  std::vector<FreeParameter> free;  ///< the parameters that moved, in the order of train.covariance
  bool valid = false;               ///< fitted, and no parameter at a bound that makes it another effect
  std::optional<FreeRunSimulation> simulation;  ///< once measured
  std::vector<double> training_segment_gap;     ///< of a plain simulation of training data, once measured

  /// After the fit has changed.
  void forget_simulations() {
    simulation.reset();
    training_segment_gap.clear();
  }
};

/// What an effect promises on a part of the training data.
struct Prediction {
  /// By how much the objective falls, as derivatives say at the best start; infinite if they do not reach so
  /// far.
  double gain = 0.0;
  /// Where its fits begin, with the equations there: of several pitches, where derivatives promise the lowest
  /// objective.
  std::vector<FitResult> starts;
};

/// The effects that either has.
std::set<std::size_t> effects_of_both(const Hypothesis& first, const Hypothesis& second);

/// How much better the richer one is, if the data count `dispersion` times less than the likelihood says.
Improvement compare(const Hypothesis& simpler, const Hypothesis& richer, double dispersion);
/// The same with the dispersion that the richer one leaves.
Improvement compare(const Hypothesis& simpler, const Hypothesis& richer);

/// What a hypothesis says about one effect, as numbers with intervals.
std::vector<ParameterEstimate> estimates_of(std::size_t effect, const Hypothesis& h);

class Search {
 public:
  /// `policy` and `budget` must outlive it. `runs`: of which `train` and `held` are parts, or thinned parts.
  Search(const Plant& plant, const std::vector<Measurement>& runs, const FitData& train, const FitData& held,
         const SelectionPolicy& policy, const SearchBudget& budget);

  const SelectionPolicy& policy() const { return policy_; }
  const SearchBudget& budget() const { return budget_; }
  const DataRange& range() const { return range_; }
  /// The plant file.
  const Plant& given() const { return given_; }
  /// The plant file's own effects and the corrections of its numbers: in every hypothesis, within what is
  /// believed of them.
  const std::vector<std::size_t>& nuisances() const { return nuisances_; }
  bool is_nuisance(std::size_t effect) const;
  /// Whether it corrects a number that stands in the plant file. The zero of the angle need not stand there.
  bool is_plant_number(std::size_t effect) const { return is_nuisance(effect) && !is_unknown_zero(effect); }
  const FitData& train_data() const { return train_; }
  const FitData& held_data() const { return held_; }
  /// Both.
  FitData all_data() const;
  /// Whether a point has the initial states of all data. Where the fit to them failed, it has those of the
  /// training data.
  bool is_of_all_data(const FitPoint& fitted) const;
  /// The data to which a point was fitted: all, or the training data where a fit to all of them failed.
  FitData data_of(const FitPoint& fitted) const;

  /// All of the training data are looked at from now on, not a part of them first.
  void screen_on_all();
  /// The same of the segment with the largest voltage, if the part could not show a saturation without it.
  /// False: it could.
  bool screen_on_largest_voltage();
  /// How much of the training data is looked at first.
  double screening_share() const {
    return static_cast<double>(screening_subset_.segments.size()) /
           static_cast<double>(train_.segments.size());
  }

  /// Base corrections and the plant's own effects within what is believed of them.
  Hypothesis baseline();
  /// Of each of these effects, were it added, on a part of the training data: quick, and only a promise.
  std::vector<Prediction> predictions(const Hypothesis& base, const std::vector<std::size_t>& effects) const;
  /// Adds an effect to a hypothesis: a few steps from each of these starts with the noise as it is, on a part
  /// of the training data. The noise is estimated again only if the objective is below `to_reach` then.
  Hypothesis screened(const Hypothesis& base, std::size_t effect, const std::vector<FitResult>& starts,
                      double to_reach) const;
  /// The same from the starts that its prediction has. The noise is estimated again in any case.
  Hypothesis screened(const Hypothesis& base, std::size_t effect) const;
  /// Brings a screened hypothesis to convergence on that part, noise included.
  void converge_on_subset(Hypothesis& screened) const;
  /// Two effects at once on that part, from where each alone was fitted, to convergence.
  Hypothesis screened_pair(const Hypothesis& base, const Hypothesis& first, const Hypothesis& second) const;
  /// A hypothesis on that part alone after a few steps with the noise as it is.
  Hypothesis descended_on_subset(const Hypothesis& base) const;
  /// Estimates the noise of a hypothesis on that part again.
  void renew_noise_on_subset(Hypothesis& on_subset) const;
  /// Both, for a comparison.
  Hypothesis on_screening_subset(const Hypothesis& base) const;
  /// Brings a screened hypothesis to convergence on the whole training data, noise included, and judges it.
  void refine(const Hypothesis& base, Hypothesis& hypothesis);
  /// The same without judging it, from the noise that it has.
  void refit(const Hypothesis& base, Hypothesis& hypothesis);
  /// From now on, no fit moves this number of the plant file.
  void hold(std::size_t number) { held_numbers_.insert(number); }
  /// Whether a number of the plant file, or an effect of it, can be held and is not yet. The zero of the
  /// angle cannot: it is known to a count only, whatever else is.
  bool can_hold(std::size_t effect) const {
    return is_plant_number(effect) && !held_numbers_.contains(effect);
  }
  const std::set<std::size_t>& held_numbers() const { return held_numbers_; }
  /// What these add to the covariance of a fit to the data, in the order of its free parameters. A number
  /// that is held is not certain: it is as uncertain as it was believed to be.
  Eigen::MatrixXd covariance_from_held_numbers(const FitData& data, const Hypothesis& fitted) const;
  /// The same hypothesis with held numbers as in the plant file.
  Hypothesis with_held_numbers(const Hypothesis& base);
  /// The same hypothesis without one effect.
  Hypothesis without(const Hypothesis& base, std::size_t effect);
  /// The same hypothesis from initial states that are guessed from the data once more: those that suited a
  /// poor model keep a good one from its place.
  Hypothesis with_new_initial_states(const Hypothesis& base);
  /// The same hypothesis with others, at these values to begin with, in the place of one effect.
  Hypothesis exchanged(const Hypothesis& base, std::size_t effect, const std::vector<PlantEffect>& others);
  /// These effects free with nothing believed of them beforehand. Everything else as in the plant file, or
  /// `settled`: within what is believed of it, but for the number `as_given`. Not judged.
  Hypothesis fitted_separately(const std::vector<std::size_t>& effects, const Hypothesis& from,
                               const Noise* fixed_noise, bool settled = false,
                               std::optional<std::size_t> as_given = {});
  /// The same point with one effect more left open, with nothing believed of it and where it does nothing:
  /// what the data then still say of the others. Or where it has this share of its typical size.
  Hypothesis with_effect_free(const Hypothesis& h, std::size_t effect, double share_of_typical = 0.0) const;
  /// The same effects fitted to all runs, held-out ones too: what is known once the choice is made.
  Hypothesis fitted_to_all_runs(const Hypothesis& h) const;
  /// All runs followed with the plant as it is and noise whose coloured part is estimated too.
  FitResult with_coloured_noise(const Hypothesis& known) const;
  /// Adds two effects at once to a hypothesis and fits to convergence.
  Hypothesis with_pair(const Hypothesis& base, const Hypothesis& first, const Hypothesis& second);
  /// A hypothesis with its parameters moved to what the held-out data say too, as far as the training runs
  /// leave them open; the noise stays.
  Hypothesis conditioned_on_held_out(const Hypothesis& h) const;
  /// Follows held-out data with this noise.
  void filter_held_out(Hypothesis& hypothesis, const Noise& noise) const;
  /// A plain simulation of held-out data, at its first call (of training data where none is held out).
  const FreeRunSimulation& simulate(Hypothesis& h) const;
  /// The same of training data, by segment.
  const std::vector<double>& simulate_training(Hypothesis& h) const;
  /// How far off what was judged is, in units of its noise.
  double gap_of(const Hypothesis& h) const;
  /// A hypothesis in which the new effect does nothing, or is of a size that makes it another effect, has
  /// lost.
  bool is_plausible(const Hypothesis& h, std::size_t effect) const;
  /// The second half of that: no size at the end of its range, no bristles that are a spring, no attached
  /// mass that does not vibrate.
  bool is_admissible(const Hypothesis& h, std::size_t effect) const;
  /// One of these two.
  using Holds = bool (Search::*)(const Hypothesis&, std::size_t) const;
  /// Whether it holds for one of these effects before a change of the model, and not after it.
  bool bends_one_of(const std::vector<std::size_t>& effects, const Hypothesis& before,
                    const Hypothesis& after, Holds holds) const;
  /// How many standard errors the size of an effect is from nothing: from what the plant file says, of a
  /// correction. Its other parameters (a shape, a place) are held: without a size they mean nothing.
  double certainty(const Hypothesis& h, std::size_t effect) const;
  /// What the free parameters of an effect beyond the first must save [evidence].
  double penalty_of(const Hypothesis& h, std::size_t effect) const;

 private:
  void choose_screening_subset(std::size_t stride);
  /// Filters held-out data with the fitted noise, for their negative log predictive density.
  void predict_held_out(Hypothesis& h) const;
  double negative_log_predictive_density_of(const Hypothesis& h) const;
  /// Bristles that bend over a good part of the track before they slide are a spring by another name.
  bool bristles_are_short(const Hypothesis& h) const;
  /// The zero of the angle where the plant file does not state it.
  bool is_unknown_zero(std::size_t effect) const;
  /// The objective of a fit that goes on from here, were residuals linear; minus infinity where that says
  /// nothing.
  static double objective_to_come(const FitResult& seen);
  /// Where the fits of an effect on the screening subset may begin, linearised there.
  std::vector<FitResult> linearised_starts(const Hypothesis& base, std::size_t effect) const;
  /// Of several pitches only the one where derivatives promise the lowest objective.
  static std::vector<FitResult> without_other_pitches(std::size_t effect, std::vector<FitResult> starts);
  /// A hypothesis's point on the screening subset alone.
  FitPoint screening_point(const Hypothesis& base) const;
  std::vector<FreeParameter> free_of(const std::set<std::size_t>& added) const;
  std::vector<std::vector<double>> starts_of(std::size_t effect, const Hypothesis& base) const;
  /// A point with an effect added, at each of its starts; a correction that is there already starts where it
  /// is.
  std::vector<FitPoint> points_with(const FitPoint& from, std::size_t effect, const Hypothesis& base) const;
  /// Where a pair starts, on all of the training data.
  FitPoint pair_point(const Hypothesis& base, const Hypothesis& first, const Hypothesis& second) const;
  std::vector<PlantState<double>> screening_starts(const std::vector<PlantState<double>>& starts) const;
  /// Fits once more from less noise, and keeps what is better: much noise and a poor fit hold each other up.
  void restart_with_low_noise(Hypothesis& h, const FitOptions& options);
  /// Whether a fit from less noise may find better: of what is far better than `base`, as a part of the
  /// training data says.
  bool may_restart_with_low_noise(const Hypothesis& base, const Hypothesis& h) const;
  Hypothesis fitted(const std::set<std::size_t>& added, const FitPoint& start, const FitOptions& options,
                    const std::vector<FreeParameter>& free);

  const SelectionPolicy& policy_;
  const SearchBudget& budget_;
  Plant given_;  ///< the plant file
  Plant plant_;  ///< the same with every correction at its neutral value
  FitData train_, held_;
  FitData screening_subset_;  ///< every few training segments: enough to see which candidates are worth a
                              ///< whole fit
  std::vector<std::size_t> screening_places_;
  DataRange range_;
  mutable EffectStarts starts_;
  std::vector<std::size_t> nuisances_;
  std::set<std::size_t> held_numbers_;
  std::vector<PlantState<double>> train_starts_, held_starts_;
};

}  // namespace upright
