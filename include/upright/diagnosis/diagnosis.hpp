// Where a plant file and measured runs disagree, which effect is missing, and how much smaller the gap is
// with it.
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

/// An effect the data ask for.
struct FoundEffect {
  std::size_t effect = 0;
  double gap_before = 0.0, gap_after = 0.0;
  std::vector<ParameterEstimate> parameters;
  std::vector<std::size_t> indistinguishable_from;
  std::string where;
};

struct CandidateScore {
  std::size_t effect = 0;
  double gap_after = 0.0;
  double evidence = 0.0;  ///< fall of minus twice the log likelihood, training runs
};

/// One effect fitted in one round of the search, and why it was taken or not.
struct Trial {
  std::size_t round = 0;
  std::size_t effect = 0;
  double evidence = 0.0;   ///< fall of minus twice the log likelihood, training runs
  double held = 0.0;       ///< the same on held-out runs
  double t_value = 0.0;    ///< of the fall per quarter of a second
  double certainty = 0.0;  ///< standard errors of its size from nothing
  Noise noise;             ///< as estimated with it
  std::vector<ParameterEstimate> parameters;
  std::string rule = "undecided";  ///< that decided: docs/reference/diagnosis-rules.md lists them
  bool taken = false;
};

/// The effects in the model after one step of the search: one added, exchanged or dropped. Values are of the
/// training runs.
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
  std::string file;       ///< of the experiment, for `upright experiment`
  double distance = 0.0;  ///< smallest separation of the surviving explanations [noise standard deviations]
};

struct Diagnosis {
  Verdict verdict = Verdict::no_discrepancy;
  /// A signal ended the search: what stands here is the best answer so far. Where it was not examined the
  /// verdict is `unexplained`, and gaps that were not measured are not numbers.
  bool interrupted = false;
  /// The bound of the search ended it. What it had found until then was examined as usual, where that did not
  /// reach a bound of its own.
  bool bound_reached = false;
  bool examined = true;  ///< what is left was examined: the verdict is one
  double gap_before = 0.0, gap_after = 0.0;
  std::vector<FoundEffect> effects;        ///< in the order found
  std::vector<CandidateScore> candidates;  ///< of the first round, best first
  std::vector<Trial> trials;               ///< every whole fit of the search, in order
  std::vector<Step> steps;                 ///< how the model grew
  std::optional<NextExperiment> next_experiment;
  Plant model;  ///< the plant with the effects added
  Noise noise;
  std::vector<std::string> notes;  ///< how the data were read and split
  std::string residual;            ///< what the remaining residual looks like
  std::vector<std::size_t> held_out_runs;
  /// On held-out segments, with the plant file as given and with the model that was found.
  std::vector<ResidualTrace> residual_before, residual_after;
};

/// Of the round that added an effect: how it did there, and the others that came near and are told apart from
/// it, the best first, three at most. Points into the diagnosis.
struct NextBest {
  const Trial* taken = nullptr;
  std::vector<const Trial*> others;
};

/// Nothing of an effect that was added otherwise: in a pair, by an exchange, or as a correction.
NextBest next_best(const Diagnosis& diagnosis, const FoundEffect& effect);

/// How often a search may follow each sample of the data at most, before the bound ends it. Searches on
/// simulated rigs needed 150 to 750; on data in wrong units, of which nothing comes, 2000 and more.
inline constexpr double default_search_bound = 10000.0;

struct DiagnosisOptions {
  /// Once it is not zero the search gives up, within some tenths of a second. Null: never.
  const std::atomic<int>* signal = nullptr;
  double search_bound = default_search_bound;
  /// Told from time to time how far the work is (0 to 1) and what it does.
  std::function<void(double, const std::string&)> progress;
  void tell(double done, const std::string& what) const {
    if (progress) progress(done, what);
  }
};

/// Diagnoses. Throws ConfigError when the plant cannot be simulated or shares nothing with the runs.
Diagnosis diagnose(const Plant& plant, const std::vector<Measurement>& runs,
                   const DiagnosisOptions& options = {});

}  // namespace upright
