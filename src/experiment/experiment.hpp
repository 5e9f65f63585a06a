// Runs an experiment: plans every piece, rehearses it in virtual time, refuses what would not stay within
// travel and voltage, then runs the pieces in turn, each as a run directory, and goes on where it was
// interrupted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "experiment_file.hpp"
#include "experiment_script.hpp"
#include "trial.hpp"
#include "upright/base/progress.hpp"
#include "upright/hal/simulated_rig.hpp"
#include "upright/record/run_reader.hpp"
#include "upright/runtime/session.hpp"

namespace upright {

/// An experiment with the files it names read.
struct ExperimentSetup {
  Experiment experiment;
  RigFile rig;                     ///< its voltage limit is the lower of rig and experiment
  Plant plant;                     ///< what the plan is made with
  std::optional<Plant> simulated;  ///< the simulated rig's own
  ControlConfig control;           ///< without a gain file: no feedback, 1000 Hz
  /// The gain files that pieces compare.
  std::map<std::filesystem::path, ControlConfig> controllers;
};

/// `plant`, where given, stands in for the experiment's and the simulated rig's. Throws ConfigError.
ExperimentSetup resolve_experiment(const std::filesystem::path& file, const std::filesystem::path& rig,
                                   const std::filesystem::path& plant, std::optional<double> sample_rate_hz);

/// Reads the gain files that pieces compare into `setup.controllers`. All run at the rate of the experiment:
/// where nothing but gain files gives it (no `sample_rate_hz` here), theirs must be the same. Throws
/// ConfigError.
void read_controllers(ExperimentSetup& setup, std::optional<double> sample_rate_hz);

/// What controls a piece that balances; of a comparison, its controller of that number.
const ControlConfig& control_of(const ExperimentSetup& setup, const Piece& piece, std::size_t controller = 0);

/// What a piece did, or would do.
struct Rehearsal {
  LoopOutcome outcome;
  std::vector<LogRecord> rows;
  double farthest_m = 0.0;
  double max_v = 0.0;
  int cut_short = 0;         ///< times the guard had to end a stretch
  bool script_over = false;  ///< false: it did not come to its end
  std::uint64_t steps = 0;   ///< control periods and integration steps that it took
  bool too_long = false;     ///< more of them than it may take: it was broken off
};

/// Runs a piece through the one loop on a simulated rig with `setup.plant`, in virtual time and in memory.
Rehearsal rehearse(const Piece& piece, const ExperimentSetup& setup);
/// The same where the rig is `real`, and the plan is made with `setup.plant` all the same.
Rehearsal rehearse(const Piece& piece, const ExperimentSetup& setup, const Plant& real);

/// A piece as it will be run: its voltages lowered where the file allows it. The rest is what its rehearsal
/// did, of a delay sweep that of the shortest delay, of a comparison the most of any controller and start.
struct PlannedPiece {
  Piece piece;
  double duration_s = 0.0, farthest_m = 0.0, max_v = 0.0;
};

/// Rehearses every piece. Throws ConfigError, with file and line, for a piece that would leave the travel,
/// could not reach its speed on it, falls, or takes more than 16 million control periods and integration
/// steps to rehearse together with those before it (some 10 s of computing).
std::vector<PlannedPiece> rehearse_all(const ExperimentSetup& setup, const ProgressCallback& progress = {});
/// The pieces of the same.
std::vector<Piece> plan_pieces(const ExperimentSetup& setup, const ProgressCallback& progress = {});

/// What the operator does before a piece, on a simulated rig.
Hand hand_for(const Piece& piece);

/// The piece as one trial runs it: one delay, one controller, one start.
Piece piece_of(const ExperimentTrial& trial, const Piece& piece);

/// The next trial, given those that were done; none: all is done.
std::optional<ExperimentTrial> next_trial(const std::vector<Piece>& pieces,
                                          const std::vector<TrialResult>& done);

/// Why delay sweeps whose trials are all done are not complete: a repeat in which nothing fell has not found
/// where it falls. Cause first; empty: every transition was found.
std::string missing_transitions(const std::vector<Piece>& pieces, const std::vector<TrialResult>& done);

/// Judges the balancing part of a run of `piece` (the whole one): amplitudes and frequency over its last
/// third. A run that never balanced has no outcome.
TrialResult judge_trial(const ExperimentTrial& trial, const Piece& piece, const std::vector<LogRecord>& rows,
                        StopReason reason);

struct ExperimentOptions {
  std::filesystem::path folder;  ///< of this experiment; made when it is not there
  std::string command;
  std::uint64_t seed = 1;
  RealtimeRequest realtime;
  RowWatcher* watcher = nullptr;  ///< of every trial's rows; null: nobody
  /// Puts what is known of a loop that balances, with the trial's delay, into its limits: how many late
  /// periods it tolerates, and whether its delay is beyond that. Empty: default_periods_late.
  std::function<void(const ControlConfig&, LoopLimits&)> know_loop;
  StopWatcher stop;  ///< of the end of every trial
  /// Before each trial. May wait for somebody, and may throw.
  std::function<void(const Piece&, const ExperimentTrial&)> announce;
  std::function<void(const TrialResult&)> finished;
  std::function<void(const LiveStatus&, ScriptPhase)> show;
};

struct ExperimentResult {
  std::vector<TrialResult> trials;  ///< also those of an interrupted call before this one
  std::size_t made = 0;             ///< in this call
  bool complete = false;
  std::string sentence;  ///< why it is not complete
  /// Of the last trial in this call. Where zero volts could not be confirmed nothing follows.
  StopReport stop = at_zero_volts();
};

/// The trials that a folder holds; none where it is not an experiment's. Throws ConfigError with file and
/// line.
std::vector<TrialResult> read_trials(const std::filesystem::path& folder);
/// Those of them that are results of `pieces`: a run of a sweep without an outcome is to be made again.
/// Throws ConfigError with file and line.
std::vector<TrialResult> read_trials(const std::filesystem::path& folder, const std::vector<Piece>& pieces);
/// The same. Throws ConfigError where the folder belongs to another experiment.
std::vector<TrialResult> read_trials(const std::filesystem::path& folder, const ExperimentSetup& setup,
                                     const std::vector<Piece>& pieces);

/// `hand` is null on hardware, whose rig is opened anew for each trial. Seven parameters: what is run (two),
/// on what (three), and how; each caller has them apart.
ExperimentResult run_experiment(const ExperimentSetup& setup, const std::vector<Piece>& pieces, Rig& rig,
                                SimulatedRigWithHand* hand, Clock& clock, const SignalFlag& signal,
                                const ExperimentOptions& options);

/// The script behind a run directory, for replay; null when it was not an experiment's.
std::unique_ptr<CommandSource> script_of(const RunRecord& run);

}  // namespace upright
