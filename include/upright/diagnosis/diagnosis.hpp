// Diagnosis of a plant file with measured runs: where they disagree, which effect is missing, and how
// much it reduces the gap.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "upright/estimation/fit.hpp"
#include "upright/estimation/parameter_estimate.hpp"
#include "upright/estimation/residual_trace.hpp"

namespace upright {

/// The name of an effect in plant files.
std::string kind_of(std::size_t effect);

enum class Verdict { explained, no_discrepancy, unexplained, not_excited };
std::string_view name_of(Verdict verdict);

/// What an effect saves on one run: the fall of minus twice the log likelihood, with the noise of the model
/// that has the effect.
struct RunEvidence {
  std::size_t run = 0;
  double evidence = 0.0;
};

/// The share of a run in what all runs save that save something; 0 if none does.
double share_of(const RunEvidence& run, const std::vector<RunEvidence>& all);

/// A stretch of a run, and what an effect saves there.
struct ShownStretch {
  std::size_t run = 0;
  double from_s = 0.0, to_s = 0.0;
  double evidence = 0.0;
};

/// An effect that the data require.
struct FoundEffect {
  std::size_t effect = 0;
  double gap_before = 0.0, gap_after = 0.0;
  std::vector<ParameterEstimate> parameters;
  std::vector<std::size_t> indistinguishable_from;
  std::string where;
  std::vector<RunEvidence> shown_on;  ///< by run; empty if it was not measured
  ShownStretch shows_most;            ///< the 0.2 s that show it most
};

/// An effect that helps a part of the data only, so that it is not named.
struct LocalEffect {
  std::size_t effect = 0;
  std::vector<ParameterEstimate> parameters;  ///< fitted to all runs
  std::string where;                          ///< where it holds and where not
  std::vector<RunEvidence> shown_on;          ///< each run fitted with its own part of the data
};

/// The smallest size of an effect that the data would have shown.
struct Detectable {
  std::size_t effect = 0;
  double size = 0.0;       ///< of its first parameter; of a number of the plant file, how far it may be off
  double usual = 0.0;      ///< order of magnitude on such a rig
  std::vector<double> at;  ///< its further parameters
};

/// A number of the plant file that the data moved.
struct MovedNumber {
  std::string name, unit;
  double file = 0.0, fitted = 0.0;
  double low = 0.0, high = 0.0;  ///< what is believed of it, from the file: 95 percent
};

/// An open-loop simulation of a run. Quantities that are not measured are NaN.
struct ModelScore {
  double gap = 0.0;  ///< error divided by the noise floor
  double cart_rmse_m = 0.0, theta_rmse_rad = 0.0;
};

/// A run that was never fitted, simulated with the plant file as given and with the model that was found.
struct ValidatedRun {
  std::string name;
  ModelScore given, found;
  bool is_worse() const { return found.gap > given.gap; }
};

struct CandidateScore {
  std::size_t effect = 0;
  double gap_after = 0.0;
  double evidence = 0.0;  ///< reduction of minus twice the log likelihood, training runs
};

/// The fit of one effect in one round of the search, and the decision on it.
struct Trial {
  std::size_t round = 0;
  std::size_t effect = 0;
  double evidence = 0.0;   ///< reduction of minus twice the log likelihood, training runs
  double held = 0.0;       ///< the same on held-out runs
  double t_value = 0.0;    ///< of the reduction per quarter of a second
  double certainty = 0.0;  ///< distance of its size from zero effect [standard errors]
  Noise noise;             ///< estimated together with the effect
  std::vector<ParameterEstimate> parameters;
  std::string rule = "undecided";  ///< the deciding rule, see docs/reference/diagnosis-rules.md
  bool taken = false;
};

/// The effects of the model after one step of the search (addition, exchange or removal of an effect).
/// Values are those of the training runs.
struct Step {
  struct Effect {
    std::size_t effect = 0;
    std::vector<ParameterEstimate> parameters;
  };
  std::vector<Effect> effects;
};

struct NextExperiment {
  std::string name;
  std::string description;
  std::string file;       ///< the experiment file, for `upright experiment`
  double distance = 0.0;  ///< smallest separation of the remaining explanations [noise standard deviations]
};

struct Diagnosis {
  Verdict verdict = Verdict::no_discrepancy;
  /// A signal ended the search: the result is the best so far. If it was not examined, the verdict is
  /// `unexplained`, and gaps that were not measured are NaN.
  bool interrupted = false;
  /// The bound of the search ended it. The result so far was examined as usual, unless that reached a
  /// bound of its own.
  bool bound_reached = false;
  bool examined = true;  ///< the residual was examined, so that the verdict is valid
  double gap_before = 0.0, gap_after = 0.0;
  std::vector<FoundEffect> effects;          ///< in the order of discovery
  std::vector<LocalEffect> helps_here_only;  ///< not in `effects`, and not in `model`
  std::vector<Detectable> detectable;
  std::vector<MovedNumber> numbers;
  std::vector<ValidatedRun> validation;    ///< filled by the caller, after the answer
  std::vector<CandidateScore> candidates;  ///< of the first round, best first
  std::vector<Trial> trials;               ///< all complete fits of the search, in order
  std::vector<Step> steps;                 ///< the model after each step
  std::optional<NextExperiment> next_experiment;
  Plant model;  ///< the plant file with the effects added
  Noise noise;
  std::vector<std::string> notes;  ///< how the data were read and split
  std::string residual;            ///< description of the remaining residual
  std::vector<std::size_t> held_out_runs;
  std::vector<std::string> run_names;
  /// On held-out segments, with the plant file as given and with the model found.
  std::vector<ResidualTrace> residual_before, residual_after;
};

/// The round that added an effect: its trial, and at most three distinguishable effects with the next
/// largest evidence, best first. Points into the diagnosis.
struct NextBest {
  const Trial* taken = nullptr;
  std::vector<const Trial*> others;
};

/// Empty for an effect that was added in a pair, by an exchange, or as a correction.
NextBest next_best(const Diagnosis& diagnosis, const FoundEffect& effect);

/// Default bound of a search, in evaluations of each sample. Searches on simulated rigs needed 150 to
/// 750; on data in wrong units, which yield no result, 2000 and more.
inline constexpr double default_search_bound = 10000.0;

struct DiagnosisOptions {
  /// A nonzero value interrupts the search within some tenths of a second. Null: no interruption.
  const std::atomic<int>* signal = nullptr;
  double search_bound = default_search_bound;
  /// Called from time to time with the progress (0 to 1) and the current activity.
  std::function<void(double, const std::string&)> progress;
  void tell(double done, const std::string& what) const {
    if (progress) progress(done, what);
  }
};

/// Throws ConfigError when the plant cannot be simulated or shares no measured quantity with the runs.
Diagnosis diagnose(const Plant& plant, const std::vector<Measurement>& runs,
                   const DiagnosisOptions& options = {});

}  // namespace upright
