#include "experiment.hpp"

#include <fstream>

#include "experiment_trials.hpp"
#include "record/provenance.hpp"
#include "upright/base/error.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

namespace {

constexpr double longest_trial_s = 7200.0;
constexpr double zero_patience_s = 2.0;
/// A swing-up that fails is tried again; one that fails so often has a cause that stays.
constexpr int max_trial_attempts = 3;
constexpr const char* again = "; start the same command again to repeat this piece";

std::string section_of(const ExperimentSetup& setup, const Piece& piece, const ScriptContext& context) {
  return "experiment:\n  name: " + setup.experiment.name + "\n  why: " + yaml_quoted(setup.experiment.why) +
         "\n  piece: " + piece_text(piece) + "\n  travel_m: " + exact_text(context.travel_m) +
         "\n  voltage_limit_v: " + exact_text(context.voltage_limit_v) +
         "\n  servo: " + servo_text(context.servo) + "\n";
}

RunSetup run_setup(const ExperimentSetup& setup, const Piece& piece, const ControlConfig& control,
                   const ExperimentOptions& options, bool simulated) {
  RunSetup run;
  run.command = options.command;
  run.duration_s = longest_trial_s;
  run.seed = options.seed;
  run.control = control;
  run.control.delay_s = piece.kind->delay_s();
  run.rig = setup.rig;
  if (simulated) run.plant = setup.simulated;
  run.limits = rig_limits(run.rig, setup.plant);
  run.limits.periods = static_cast<std::uint64_t>(longest_trial_s * run.control.sample_rate_hz);
  run.limits.max_periods_late = default_periods_late(run.control.period_s());
  if (balances(piece) && options.know_loop) options.know_loop(run.control, run.limits);
  return run;
}

void start_folder(const ExperimentSetup& setup, const std::vector<Piece>& pieces,
                  const std::filesystem::path& folder) {
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  const std::filesystem::path file = folder / "experiment.yaml";
  if (std::filesystem::exists(file, problem)) return;
  std::ofstream out(file, std::ios::binary);
  out << experiment_record(setup, pieces);
  out.close();
  write_plant_file(setup.plant, folder / "plan_plant.yaml", {"What the plan was made with."});
  if (!out) throw ConfigError("cannot write " + file.string() + ": choose a writable folder with --out");
}

/// A trial that was made. Without an outcome: why, and whether it may be made again without anybody's hands.
struct Attempt {
  TrialResult result;
  std::string sentence;
  bool may_repeat = false;
  StopReport stop = at_zero_volts();  ///< where zero volts could not be confirmed nothing may follow
};

/// Makes one trial after another on a rig, each as a run directory.
class TrialMaker {
 public:
  TrialMaker(const ExperimentSetup& setup, Rig& rig, SimulatedRigWithHand* hand, Clock& clock,
             const SignalFlag& signal, const ExperimentOptions& options)
      : setup_(setup), rig_(rig), hand_(hand), clock_(clock), signal_(signal), options_(options) {}

  Attempt make(const Piece& whole, const ExperimentTrial& trial) {
    const Piece piece = piece_of(trial, whole);
    const ControlConfig& control = control_of(setup_, whole, trial.controller);
    prepare(piece);
    const ScriptContext context{control.period_s(), setup_.experiment.travel_m, setup_.rig.amplifier.limit_v,
                                servo_model(setup_.plant), control.gains};
    ExperimentScript script(piece, context);
    RunSetup run = run_setup(setup_, piece, control, options_, hand_ != nullptr);
    run.label = whole.label + whole.kind->suffix(trial);
    run.fast = clock_.is_virtual();
    run.experiment_text = section_of(setup_, piece, context);
    SessionOptions session;
    session.out = options_.folder;
    session.realtime = options_.realtime;
    session.parts = make_model_parts(run.control);
    session.source = &script;
    session.watcher = options_.watcher;
    session.stop = options_.stop;
    if (options_.show) session.show = [&](const LiveStatus& live) { options_.show(live, script.phase()); };
    const LoopLimits limits = run.limits;
    const SessionResult done = run_session(std::move(run), rig_, clock_, signal_, std::move(session));
    Attempt attempt = judged(whole, trial, done, limits, script.phase() == ScriptPhase::over);
    if (compares(whole)) attempt.result.controller = whole.kind->controllers()[trial.controller].name;
    if (balances(whole))
      attempt.result.gains = csv_name(compares(whole) ? whole.kind->controllers()[trial.controller].file
                                                      : setup_.experiment.gains);
    return attempt;
  }

 private:
  /// Hardware may have been switched off meanwhile; a simulated rig goes on from where it is, unless hands
  /// are laid on it.
  void prepare(const Piece& piece) {
    if (hand_ == nullptr || !is_open_) rig_.open();
    find_zero(rig_, clock_, setup_.rig, zero_patience_s);
    if (hand_ != nullptr) {
      const Hand next = hand_for(piece);
      const bool hands_on =
          next.cart_held || next.holds_s > 0.0 || next.amplifier_off || next.turned || next.push_mps != 0.0;
      const bool changes = last_hand_.cart_held || last_hand_.amplifier_off || last_hand_.turned;
      if (!is_open_ || hands_on || changes) {
        hand_->handle(next);
        rig_.moved_by_hand();
      }
      last_hand_ = next;
    }
    is_open_ = true;
  }

  static Attempt judged(const Piece& piece, const ExperimentTrial& trial, const SessionResult& done,
                        const LoopLimits& limits, bool script_over) {
    const StopReason reason = done.outcome.reason;
    Attempt attempt;
    attempt.stop = done.outcome.stop;
    // Before anything else of this trial can fail: whoever is beside the rig must know.
    if (!attempt.stop.done() || !done.log.failure.empty()) {
      attempt.sentence =
          sentence_of(done.outcome, limits, done.log) + "; in " + done.directory.string() + again;
      return attempt;
    }
    attempt.result = judge_trial(trial, piece, read_samples(done.directory / "samples.csv").rows, reason);
    attempt.result.run_directory = done.directory.filename().string();
    if (reason == StopReason::duration && !script_over) {
      attempt.result.outcome.clear();
      attempt.sentence = "the piece " + piece.label + " did not end within " + exact_text(longest_trial_s) +
                         " s, the longest time of a run: make the piece shorter";
    } else {
      attempt.sentence = sentence_of(done.outcome, limits);
    }
    attempt.sentence += "; in " + done.directory.string() + again;
    const bool lost = reason == StopReason::not_ready || reason == StopReason::track_limit;
    attempt.may_repeat = lost && balances(piece) && piece.kind->swings_up();
    return attempt;
  }

  ExperimentSetup setup_;  // its zero is found with the first trial
  Rig& rig_;
  SimulatedRigWithHand* hand_;
  Clock& clock_;
  const SignalFlag& signal_;
  const ExperimentOptions& options_;
  bool is_open_ = false;
  Hand last_hand_;
};

}  // namespace

// Seven parameters: experiment.hpp says why.
ExperimentResult run_experiment(const ExperimentSetup& setup, const std::vector<Piece>& pieces, Rig& rig,
                                SimulatedRigWithHand* hand, Clock& clock, const SignalFlag& signal,
                                const ExperimentOptions& options) {
  ExperimentResult result;
  result.trials = read_trials(options.folder, setup, pieces);
  start_folder(setup, pieces, options.folder);
  TrialMaker maker(setup, rig, hand, clock, signal, options);
  int attempts = 0;
  while (const std::optional<ExperimentTrial> trial = next_trial(pieces, result.trials)) {
    const Piece& piece = pieces[trial->piece];
    if (options.announce) options.announce(piece, *trial);
    if (signal.load() != 0) {
      result.sentence = "the experiment was stopped: start the same command again to continue";
      return result;
    }
    const Attempt attempt = maker.make(piece, *trial);
    ++result.made;
    ++attempts;
    result.stop = attempt.stop;
    if (attempt.result.outcome.empty()) {
      if (attempt.may_repeat && attempts < max_trial_attempts && attempt.stop.done()) continue;
      result.sentence = attempt.sentence;
      if (attempts > 1)
        result.sentence +=
            "; " + std::to_string(attempts) + " attempts in a row ended before the pendulum balanced";
      return result;
    }
    attempts = 0;
    result.trials.push_back(attempt.result);
    write_trials(options.folder, pieces, result.trials);
    write_sweep_tables(options.folder, pieces, result.trials);
    if (options.finished) options.finished(attempt.result);
  }
  result.sentence = missing_transitions(pieces, result.trials);
  result.complete = result.sentence.empty();
  return result;
}

std::unique_ptr<CommandSource> script_of(const RunRecord& run) {
  const std::optional<YamlMap> map = run.document.optional_map("experiment");
  if (!map) return nullptr;
  const ScriptContext context{run.control.period_s(), map->number("travel_m", Range::positive()),
                              map->number("voltage_limit_v", Range::positive()),
                              read_servo(map->map("servo")), run.control.gains};
  return std::make_unique<ExperimentScript>(read_piece(map->map("piece")), context);
}

}  // namespace upright
