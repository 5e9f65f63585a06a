// Delay sweeps: which starting angle under which delay is held, oscillates or falls, and at which delay that
// changes. The same result bytes for any number of threads or processes, and after an interruption.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "upright/model/plant.hpp"
#include "upright/sim/loop/loop_run.hpp"

namespace upright {

/// Both fast ones are the lanes, or the event engine where they do not reach: `fast` on this processor's
/// registers, with last digits of its own, `reproducible` on the baseline's, with the same bits on every
/// machine.
enum class SweepEngine : std::uint8_t { fast, reproducible, reference };

/// A sweep file (interface: "Sweep file") with the files it names read.
struct SweepConfig {
  LoopSetup setup;
  std::filesystem::path plant_file;
  Plant plant;  ///< what `setup.model` was made of, for the linear margins
  SweepEngine engine = SweepEngine::fast;
  std::vector<double> theta0_rad;
  std::vector<double> delay_s;  ///< increasing
  double stable_below_rad = 0.0016;
  /// The sweep with every file it names written out: what the results depend on, and nothing else.
  std::string resolved_text;
};

/// Reads a sweep file. Throws ConfigError with remedy, file, line and key.
SweepConfig read_sweep_file(const std::filesystem::path& file);

enum class Outcome : std::uint8_t { stable, oscillating, fell };
std::string outcome_name(Outcome outcome);

struct SweepRun {
  LoopCase start;
  double fall_time_s = 0.0;  ///< not a number: it did not fall
  double theta_amplitude_rad = 0.0;
  double cart_amplitude_m = 0.0;

  Outcome outcome(double stable_below_rad) const;
};

/// From which delay on a starting angle is not held still, and from which it falls; not a number where that
/// does not happen within the sweep's delays. Found to `transition_tolerance_s`.
struct Transition {
  double theta0_rad = 0.0;
  double oscillates_from_s = 0.0;
  double falls_from_s = 0.0;
};
inline constexpr double transition_tolerance_s = 1e-4;

/// A critical delay of the linear analysis, to be drawn beside what the runs did.
struct LinearMargin {
  std::string model;              ///< "near rest" (dry friction smoothed) or "sliding" (without dry friction)
  double critical_delay_s = 0.0;  ///< 0: unstable without delay; infinite: stable under any
  double crossing_radps = 0.0;
};
/// Of the sweep's own loop, continuous or sampled. None for a loop with a predictor: that has another gain at
/// every delay.
std::vector<LinearMargin> linear_margins(const SweepConfig& config);

struct SweepOptions {
  unsigned threads = 0;  ///< 0: one per processor
  bool overwrite = false;
  /// Search the transitions by bisection over the delays instead of running the whole grid. Takes for granted
  /// that a start which fell falls under every longer delay of the list too.
  bool transitions_only = false;
  /// Called after each group of runs, from one thread at a time.
  std::function<void(std::size_t runs_done, std::size_t runs_known)> progress;
  const std::atomic<bool>* stop = nullptr;  ///< set it to stop; what is done is kept
};

struct SweepResult {
  std::vector<SweepRun> runs;  ///< by starting angle, then delay
  std::vector<Transition> transitions;
  std::size_t runs_made = 0;  ///< in this call: not those that an interrupted call had done
  bool interrupted = false;
};

/// Runs groups of cases, here or elsewhere.
class SweepExecutor {
 public:
  using Group = std::vector<LoopCase>;
  using Done = std::function<void(std::size_t group, const std::vector<SweepRun>& runs)>;
  virtual ~SweepExecutor() = default;
  /// Calls `done` once for each group, in any order but one call at a time, until all are done or `stop` is
  /// set.
  virtual void run(const std::vector<Group>& groups, const Done& done, const std::atomic<bool>* stop) = 0;
};

/// The processors of this machine. `threads` 0: all of them.
std::unique_ptr<SweepExecutor> make_thread_executor(const SweepConfig& config, unsigned threads);

/// One group of at most `sweep_group_size(config)` runs by the sweep's engine.
std::vector<SweepRun> run_sweep_group(const SweepConfig& config, const SweepExecutor::Group& group);
std::size_t sweep_group_size(const SweepConfig& config);

/// The transitions alone, by bisection over the list of delays, nothing written.
std::vector<Transition> find_transitions(const SweepConfig& config, SweepExecutor& executor);

/// Runs the sweep and writes `sweep.csv`, `transitions.csv`, `margins.csv` and `sweep.yaml` into `folder`.
/// While it goes on, `sweep.partial` there keeps what is done; a later call with the same sweep goes on from
/// it. Throws ConfigError where the gains hold the plant neither near rest nor sliding even without delay,
/// where the folder holds results already (unless `overwrite`) or those of another sweep.
SweepResult run_sweep(const SweepConfig& config, const std::filesystem::path& folder,
                      const SweepOptions& options, SweepExecutor& executor);

}  // namespace upright
