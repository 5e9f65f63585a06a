// Runs an experiment: plans every piece, rehearses it in virtual time, refuses what would not stay within
// travel and voltage, then runs the pieces in turn, each as a run directory, and goes on where it was
// interrupted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "upright/hal/simulated_rig.hpp"
#include "upright/runtime/experiment_script.hpp"
#include "upright/runtime/run_reader.hpp"
#include "upright/runtime/session.hpp"

namespace upright {

/// An experiment with the files it names read.
struct ExperimentSetup {
  Experiment experiment;
  RigFile rig;                     ///< its voltage limit is the lower of rig and experiment
  Plant plant;                     ///< what the plan is made with
  std::optional<Plant> simulated;  ///< the simulated rig's own
  ControlConfig control;           ///< without a gain file: no feedback, 1000 Hz
};

/// `plant`, where given, stands in for the experiment's and the simulated rig's. Throws ConfigError.
ExperimentSetup resolve_experiment(const std::filesystem::path& file, const std::filesystem::path& rig,
                                   const std::filesystem::path& plant, std::optional<double> sample_rate_hz);

/// What a piece did, or would do.
struct Rehearsal {
  LoopOutcome outcome;
  std::vector<LogRecord> rows;
  double farthest_m = 0.0;
  int cut_short = 0;  ///< times the guard had to end a stretch
};

/// Runs a piece through the one loop on a simulated rig with `setup.plant`, in virtual time and in memory.
Rehearsal rehearse(const Piece& piece, const ExperimentSetup& setup);
/// The same where the rig is `real`, and the plan is made with `setup.plant` all the same.
Rehearsal rehearse(const Piece& piece, const ExperimentSetup& setup, const Plant& real);

/// The pieces as they will be run: voltages lowered where the file allows it. Throws ConfigError, remedy
/// first, for a piece that would leave the travel, could not reach its speed on it, or falls.
std::vector<Piece> plan_pieces(const ExperimentSetup& setup);

/// What the operator does before a piece, on a simulated rig.
Hand hand_for(const Piece& piece);

/// One run: a piece, or one delay of a sweep.
struct ExperimentTrial {
  std::size_t piece = 0;
  int repeat = 0;
  double delay_s = 0.0;
};

/// How a trial went. `outcome`: "done", or for delay sweeps "stable", "oscillating" or "fell".
struct TrialResult {
  ExperimentTrial trial;
  std::string run_directory;  ///< within the experiment's folder
  std::string reason;         ///< of the loop's end
  std::string outcome;
  double theta0_rad = 0.0, theta_amplitude_rad = 0.0, cart_amplitude_m = 0.0;
  double fall_time_s = 0.0;   ///< not a number: it did not fall
  double frequency_hz = 0.0;  ///< of the angle; not a number where it does not oscillate
};

/// The next trial, given those that were done; none: all is done. Delays grow, so that falls come late; what
/// lies between two outcomes is bisected, the fall last.
std::optional<ExperimentTrial> next_trial(const std::vector<Piece>& pieces,
                                          const std::vector<TrialResult>& done);

/// Judges the balancing part of a run: amplitudes and frequency over its last third.
TrialResult judge_trial(const ExperimentTrial& trial, const Piece& piece, const std::vector<LogRecord>& rows,
                        StopReason reason);

struct ExperimentOptions {
  std::filesystem::path folder;  ///< of this experiment; made when it is not there
  std::string command;
  std::uint64_t seed = 1;
  RealtimeRequest realtime;
  RowWatcher* watcher = nullptr;  ///< of every trial's rows; null: nobody
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
};

/// The trials that a folder holds; none where it is not an experiment's.
std::vector<TrialResult> read_trials(const std::filesystem::path& folder);
/// Trials that a folder holds already. Throws ConfigError where it belongs to another experiment.
std::vector<TrialResult> read_trials(const std::filesystem::path& folder, const ExperimentSetup& setup,
                                     const std::vector<Piece>& pieces);

/// `hand` is null on hardware, whose rig is opened anew for each trial.
ExperimentResult run_experiment(const ExperimentSetup& setup, const std::vector<Piece>& pieces, Rig& rig,
                                SimulatedRigWithHand* hand, Clock& clock, const SignalFlag& signal,
                                const ExperimentOptions& options);

/// The script behind a run directory, for replay; null when it was not an experiment's.
std::unique_ptr<CommandSource> script_of(const RunRecord& run);

}  // namespace upright
