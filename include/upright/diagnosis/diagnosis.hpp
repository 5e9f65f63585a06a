// Diagnosis of a plant file with measured runs: where they disagree, which effect is missing, and how
// much it reduces the gap.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "upright/estimation/noise.hpp"
#include "upright/estimation/residual_trace.hpp"
#include "upright/measurement/measurement.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// An estimated parameter of an effect, with its uncertainty.
struct ParameterEstimate {
  std::string name;    ///< as in plant files
  std::string unit;    ///< of the value
  double value = 0.0;  ///< the estimate
  double low = 0.0;    ///< lower end of the 95 percent confidence interval
  double high = 0.0;   ///< upper end
};

/// The name of an effect in plant files.
std::string kind_of(std::size_t effect);

/// What the data say about the model.
enum class Verdict { explained, no_discrepancy, unexplained, not_excited, described };
std::string_view name_of(Verdict verdict);  ///< "explained", "no_discrepancy", ..

/// What an effect saves on one run: the fall of minus twice the log likelihood, with the noise of the model
/// that has the effect.
struct RunEvidence {
  std::size_t run = 0;    ///< its place among the runs
  double evidence = 0.0;  ///< of the effect on it
};

/// The share of a run in what all runs save that save something; 0 if none does.
double share_of(const RunEvidence& run, const std::vector<RunEvidence>& all);

/// A stretch of a run, and what an effect saves there.
struct ShownStretch {
  std::size_t run = 0;    ///< its place among the runs
  double from_s = 0.0;    ///< begin, in the record's time
  double to_s = 0.0;      ///< end, in the record's time
  double evidence = 0.0;  ///< of the effect there
};

/// The size of an effect in one run, with all else common to all runs.
struct RunSize {
  std::size_t run = 0;  ///< its place among the runs
  double value = 0.0;   ///< of the effect's first parameter
  double low = 0.0;     ///< lower end of the 95 percent confidence interval
  double high = 0.0;    ///< upper end
};

/// An effect that the data require.
struct FoundEffect {
  std::size_t effect = 0;                     ///< number in the registry
  double gap_before = 0.0;                    ///< held-out error over the noise floor, without it
  double gap_after = 0.0;                     ///< the same with it
  std::vector<ParameterEstimate> parameters;  ///< values in the resulting model
  /// Numbers of the effects that the data cannot tell from it.
  std::vector<std::size_t> indistinguishable_from;
  std::string where;                  ///< where in time and state the disagreement is, in words
  std::vector<RunEvidence> shown_on;  ///< by run; empty if it was not measured
  ShownStretch shows_most;            ///< the 0.2 s that show it most
  std::vector<RunSize> by_run;        ///< its size in each run; empty for one run
};

/// An effect that helps a part of the data only, so that it is not named.
struct LocalEffect {
  std::size_t effect = 0;                     ///< number in the registry
  std::vector<ParameterEstimate> parameters;  ///< fitted to all runs
  std::string where;                          ///< where it holds and where not
  std::vector<RunEvidence> shown_on;          ///< each run fitted with its own part of the data
  std::vector<RunSize> by_run;                ///< its size in each run, if that is why it is not named
};

/// The smallest size of an effect that the data would have shown.
struct Detectable {
  std::size_t effect = 0;  ///< number in the registry
  double size = 0.0;       ///< of its first parameter; of a number of the plant file, how far it may be off
  double usual = 0.0;      ///< order of magnitude on such a rig
  std::vector<double> at;  ///< its further parameters
};

/// A number of the plant file that the data moved.
struct MovedNumber {
  std::string name;     ///< as in the plant file
  std::string unit;     ///< of the number
  double file = 0.0;    ///< its value there
  double fitted = 0.0;  ///< its value in the model
  double low = 0.0;     ///< the least that is believed of it, from the file: 95 percent
  double high = 0.0;    ///< the most
};

/// What was measured of a quantity.
struct QuantityRange {
  std::string quantity;  ///< `cart_m`, `cart_mps`, `theta_rad`, `theta_radps` or `voltage_v`
  std::string unit;      ///< of the quantity
  double low = 0.0;      ///< the least value
  double high = 0.0;     ///< the largest value
};

/// An open-loop simulation of a run. Quantities that are not measured are NaN.
struct ModelScore {
  double gap = 0.0;             ///< error divided by the noise floor
  double cart_rmse_m = 0.0;     ///< of the cart's position
  double theta_rmse_rad = 0.0;  ///< of the pendulum's angle
};

/// A run that was never fitted, simulated with the plant file as given and with the model that was found.
struct ValidatedRun {
  std::string name;  ///< its file
  ModelScore given;  ///< with the plant file as given
  ModelScore found;  ///< with the model found
  /// Quantities that the run took beyond the range of the fitted runs, where the model was not tested.
  std::vector<QuantityRange> beyond;
  /// Whether the model found is further off than the plant file.
  bool is_worse() const { return found.gap > given.gap; }
};

/// What one candidate achieved.
struct CandidateScore {
  std::size_t effect = 0;  ///< number in the registry
  double gap_after = 0.0;  ///< gap with it: held-out error over the noise floor
  double evidence = 0.0;   ///< reduction of minus twice the log likelihood, training runs
};

/// The fit of one effect in one round of the search, and the decision on it.
struct Trial {
  std::size_t round = 0;                      ///< number of the round of the search, from 0
  std::size_t effect = 0;                     ///< number in the registry
  double evidence = 0.0;                      ///< reduction of minus twice the log likelihood, training runs
  double held = 0.0;                          ///< the same on held-out runs
  double t_value = 0.0;                       ///< of the reduction per quarter of a second
  double certainty = 0.0;                     ///< distance of its size from zero effect [standard errors]
  double dispersion = 1.0;                    ///< of the fit (FitResult::dispersion)
  Noise noise;                                ///< estimated together with the effect
  std::vector<ParameterEstimate> parameters;  ///< values of this fit
  std::string rule = "undecided";             ///< the deciding rule, see docs/reference/diagnosis-rules.md
  bool taken = false;                         ///< whether the effect was added
};

/// The effects of the model after one step of the search (addition, exchange or removal of an effect).
/// Values are those of the training runs.
struct Step {
  /// An effect of the model.
  struct Effect {
    std::size_t effect = 0;                     ///< number in the registry
    std::vector<ParameterEstimate> parameters;  ///< values of the fit
  };
  std::vector<Effect> effects;  ///< every effect of the model then
};

/// A statistic of what the model leaves, compared with draws from the model. Something is missing where it is
/// beyond its limit and the p-value is too small for chance.
struct ResidualStatistic {
  std::string name;               ///< what is tested
  double value = 0.0;             ///< of the innovations; NaN: the data do not show it
  double limit = 0.0;             ///< what counts is beyond it
  bool counts_above = true;       ///< whether that is above the limit, or below
  std::optional<double> p_value;  ///< absent: no statistic was beyond its limit, so none was computed
  bool fails = false;             ///< something is missing
};

/// A safe run that would distinguish them.
struct NextExperiment {
  std::string name;         ///< of the experiment
  std::string description;  ///< what it does, for people
  std::string file;         ///< the experiment file, for `upright experiment`
  double distance = 0.0;    ///< smallest separation of the remaining explanations [noise standard deviations]
};

/// The result of a diagnosis.
struct Diagnosis {
  Verdict verdict = Verdict::no_discrepancy;  ///< the conclusion
  /// A signal ended the search: the result is the best so far. If it was not examined, the verdict is
  /// `unexplained`, and gaps that were not measured are NaN.
  bool interrupted = false;
  /// The bound of the search ended it. The result so far was examined as usual, unless that reached a
  /// bound of its own.
  bool bound_reached = false;
  bool examined = true;              ///< the residual was examined, so that the verdict is valid
  double gap_before = 0.0;           ///< held-out error over the noise floor, of the plant file as given
  double gap_after = 0.0;            ///< the same of the model found
  std::vector<FoundEffect> effects;  ///< in the order of discovery
  std::vector<LocalEffect> helps_here_only;       ///< not in `effects`, and not in `model`
  std::vector<Detectable> detectable;             ///< what the data would have shown
  std::vector<MovedNumber> numbers;               ///< numbers of the plant file that moved
  std::vector<ValidatedRun> validation;           ///< filled by the caller, after the answer
  std::vector<CandidateScore> candidates;         ///< of the first round, best first
  std::vector<Trial> trials;                      ///< all complete fits of the search, in order
  std::vector<Step> steps;                        ///< the model after each step
  std::optional<NextExperiment> next_experiment;  ///< absent: none is needed
  Plant model;                                    ///< the plant file with the effects added
  Noise noise;                                    ///< as estimated with the model
  std::vector<std::string> notes;                 ///< how the data were read and split
  std::string residual;                           ///< description of the remaining residual
  std::vector<ResidualStatistic> residual_tests;  ///< empty: the residual is the sensors' own noise
  std::vector<std::size_t> held_out_runs;         ///< runs that no fit saw
  std::vector<std::string> run_names;             ///< of all runs, in their order
  std::vector<QuantityRange> measured_range;      ///< of all runs: beyond it the model is not tested
  /// What a quick diagnosis left out, in words; empty: it was a complete one.
  std::vector<std::string> not_examined;
  double work_samples = 0.0;                   ///< number of samples processed, counting repetitions
  std::vector<ResidualTrace> residual_before;  ///< on held-out segments, with the plant file as given
  std::vector<ResidualTrace> residual_after;   ///< the same with the model found
};

/// The round that added an effect: its trial, and at most three distinguishable effects with the next
/// largest evidence, best first. Points into the diagnosis.
struct NextBest {
  const Trial* taken = nullptr;      ///< the trial that added it; null: there is none
  std::vector<const Trial*> others;  ///< at most three, best first
};

/// Empty for an effect that was added in a pair, by an exchange, or as a correction.
NextBest next_best(const Diagnosis& diagnosis, const FoundEffect& effect);

/// Default bound of a search, in evaluations of each sample. Searches on simulated rigs needed 150 to
/// 750; on data in wrong units, which yield no result, 2000 and more.
inline constexpr double default_search_bound = 10000.0;

/// How a diagnosis searches.
struct DiagnosisOptions {
  /// A nonzero value interrupts the search within some tenths of a second. Null: no interruption.
  const std::atomic<int>* signal = nullptr;
  double search_bound = default_search_bound;  ///< in evaluations of each sample
  /// Only what is certain, in a tenth of the time.
  bool quick = false;
  /// Called from time to time with the progress (0 to 1) and the current activity.
  std::function<void(double, const std::string&)> progress;
  /// Reports progress, where anybody listens: `done` from 0 to 1.
  void report_progress(double done, const std::string& what) const {
    if (progress) progress(done, what);
  }
};

/// Throws ConfigError when the plant cannot be simulated or shares no measured quantity with the runs.
Diagnosis diagnose(const Plant& plant, const std::vector<Measurement>& runs,
                   const DiagnosisOptions& options = {});

}  // namespace upright
