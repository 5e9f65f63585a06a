// Delay sweeps: the outcome (stable, oscillates, falls) for each initial angle and delay, and where it
// changes. Results are byte-identical for any number of threads or processes, and after interruptions.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim/loop/loop_run.hpp"
#include "uncertainty.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// The two fast engines use lanes, or the event engine where lanes are not applicable: `fast` with this
/// processor's registers and processor-dependent last digits, `reproducible` with the baseline and
/// identical bits on all machines.
enum class SweepEngine : std::uint8_t { fast, reproducible, reference };

class YamlKeys;

/// A sweep file (docs/reference/files.md), including the files that it names.
struct SweepConfig {
  LoopSetup setup;
  std::filesystem::path plant_file, gain_file;
  Plant plant;  ///< the plant of `setup.model`, for the linear margins
  SweepEngine engine = SweepEngine::fast;
  std::vector<double> theta0_rad;
  std::vector<double> delay_s;  ///< increasing
  double stable_below_rad = 0.0016;
  std::optional<Uncertainty> uncertainty;
  /// The sweep with the contents of all files that it names: exactly the inputs on which results depend.
  std::string resolved_text;
};

/// A task of a sweep, or what came of it.
using SweepNumbers = std::vector<double>;

/// Visits the keys of the whole file without the files that it names, for the schema.
void sweep_keys(YamlKeys& document, SweepConfig& config);

/// Reads a sweep file. Throws ConfigError with remedy, file, line and key.
SweepConfig read_sweep_file(const std::filesystem::path& file);

enum class Outcome : std::uint8_t { stable, oscillating, fell };
std::string outcome_name(Outcome outcome);

struct SweepRun {
  LoopCase start;
  double fall_time_s = 0.0;  ///< NaN: it did not fall
  double theta_amplitude_rad = 0.0;
  double cart_amplitude_m = 0.0;

  Outcome outcome(double stable_below_rad) const;
};

/// The smallest delays at which an initial angle leads to oscillation and to a fall; NaN where that does
/// not occur within the delays of the sweep. Accurate to `transition_tolerance_s`.
struct Transition {
  double theta0_rad = 0.0;
  double oscillates_from_s = 0.0;
  double falls_from_s = 0.0;
};
inline constexpr double transition_tolerance_s = 1e-4;

/// A critical delay of the linear analysis, for comparison with the runs.
struct LinearMargin {
  std::string model;              ///< "near rest" (dry friction smoothed) or "sliding" (without dry friction)
  double critical_delay_s = 0.0;  ///< 0: unstable without delay; infinite: stable under any
  double crossing_radps = 0.0;
};
/// For the loop of the sweep, continuous or sampled. None with a predictor, whose gains depend on the
/// delay.
std::vector<LinearMargin> linear_margins(const SweepConfig& config);

/// How long a sweep will take.
struct SweepEstimate {
  std::size_t runs = 0;  ///< those of the grid and of all plants, without the search for transitions
  double run_s = 0.0;    ///< processor time of one
};

struct SweepOptions {
  unsigned threads = 0;  ///< 0: one per processor
  bool overwrite = false;
  /// Find the transitions by bisection over the delays instead of running the whole grid. Assumes that a
  /// start that falls also falls for every longer delay in the list. No map over plants.
  bool transitions_only = false;
  /// Called before the first run of a sweep over plants: the runs that remain, and the processor time of
  /// one.
  std::function<void(const SweepEstimate& remaining)> estimated;
  /// Called after each group of runs, by one thread at a time.
  std::function<void(std::size_t runs_done, std::size_t runs_known)> progress;
  const std::atomic<bool>* stop = nullptr;  ///< set it to stop; completed runs are kept
};

struct SweepResult {
  std::vector<SweepRun> runs;  ///< by starting angle, then delay
  std::vector<Transition> transitions;
  std::vector<UncertainPoint> uncertain;  ///< by starting angle, then delay; empty without `uncertainty`
  std::size_t runs_made = 0;              ///< in this call, without those of an interrupted earlier call
  bool interrupted = false;
};

/// Executes the tasks of a sweep (sweep_tasks.hpp), on this machine or on others.
class SweepExecutor {
 public:
  using TaskOf = std::function<SweepNumbers(std::size_t number)>;
  using Done = std::function<void(std::size_t number, const SweepNumbers& result)>;
  virtual ~SweepExecutor() = default;
  /// Calls `done` once for each of `count` tasks, in any order but one call at a time, until all are done or
  /// `stop` is set. `task_of` is called by several threads; nothing else is kept of tasks that wait.
  virtual void run(std::size_t count, const TaskOf& task_of, const Done& done,
                   const std::atomic<bool>* stop) = 0;
};

/// Threads on this machine. `threads` 0: all processors.
std::unique_ptr<SweepExecutor> make_thread_executor(const SweepConfig& config, unsigned threads);

/// Simulates one group of at most `sweep_group_size(config)` runs with the sweep's engine.
std::vector<SweepRun> run_sweep_group(const SweepConfig& config, const std::vector<LoopCase>& group);
std::size_t sweep_group_size(const SweepConfig& config);

/// Measures a few of the runs.
SweepEstimate estimate_sweep(const SweepConfig& config);

/// Finds the transitions only, by bisection over the delays; writes no files.
std::vector<Transition> find_transitions(const SweepConfig& config, SweepExecutor& executor);

/// Runs the sweep; writes `sweep.csv`, `transitions.csv`, `margins.csv`, `sweep.yaml` and, with
/// `uncertainty`, `uncertainty.csv` into `folder`.
/// `sweep.partial` keeps completed runs, from which a later call with the same sweep resumes. Throws
/// ConfigError if the gains stabilise the plant neither near rest nor sliding even without delay, or if
/// the folder already has results (unless `overwrite`) or those of another sweep.
SweepResult run_sweep(const SweepConfig& config, const std::filesystem::path& folder,
                      const SweepOptions& options, SweepExecutor& executor);

}  // namespace upright
