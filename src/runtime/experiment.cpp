#include "upright/runtime/experiment.hpp"

#include <cmath>
#include <fstream>
#include <numbers>

#include "experiment_trials.hpp"
#include "upright/control/predictor.hpp"
#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/runtime/provenance.hpp"

namespace upright {

namespace {

constexpr double longest_trial_s = 7200.0;
constexpr double zero_patience_s = 2.0;

/// The piece as one trial runs it.
Piece piece_of(const ExperimentTrial& trial, const std::vector<Piece>& pieces) {
  Piece piece = pieces[trial.piece];
  piece.delay_s = trial.delay_s;
  if (piece.kind == PieceKind::delay_sweep) piece.delays_s = {trial.delay_s};
  return piece;
}

std::string label_of(const ExperimentTrial& trial, const Piece& piece) {
  if (piece.kind != PieceKind::delay_sweep) return piece.label;
  // Tenths of a microsecond: whole numbers sort and make no odd characters.
  const auto tenths = static_cast<long long>(std::llround(trial.delay_s * 1e7));
  return piece.label + "-" + std::to_string(tenths / 10000) + "." +
         std::to_string(10000 + tenths % 10000).substr(1) + "ms-" + std::to_string(trial.repeat + 1);
}

std::string section_of(const ExperimentSetup& setup, const Piece& piece, const ScriptContext& context) {
  return "experiment:\n  name: " + setup.experiment.name + "\n  why: " + yaml_quoted(setup.experiment.why) +
         "\n  piece: " + piece_text(piece) + "\n  travel_m: " + exact_text(context.travel_m) +
         "\n  voltage_limit_v: " + exact_text(context.voltage_limit_v) +
         "\n  servo: " + servo_text(context.servo) + "\n";
}

RunSetup run_setup(const ExperimentSetup& setup, const Piece& piece, const ExperimentTrial& trial,
                   const ExperimentOptions& options, bool simulated, bool fast) {
  RunSetup run;
  run.command = options.command;
  run.label = label_of(trial, piece);
  run.duration_s = longest_trial_s;
  run.fast = fast;
  run.seed = options.seed;
  run.control = setup.control;
  run.control.delay_s = piece.delay_s;
  run.rig = setup.rig;
  if (simulated) run.plant = setup.simulated;
  run.limits.periods = static_cast<std::uint64_t>(longest_trial_s * run.control.sample_rate_hz);
  run.limits.track_limit_m = run.rig.track_limit_m;
  run.limits.fall_angle_rad = run.rig.fall_angle_rad;
  run.limits.watchdog_s = run.rig.watchdog_s;
  run.limits.most_periods_late = default_periods_late(run.control.period_s());
  return run;
}

/// Which ends of a run are a result; every other one stops the experiment.
bool is_result(StopReason reason, const Piece& piece) {
  if (reason == StopReason::duration) return true;
  return piece.kind == PieceKind::delay_sweep &&
         (reason == StopReason::fell || reason == StopReason::track_limit);
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
  if (!out) throw ConfigError("name a folder that can be written with --out: cannot write " + file.string());
}

}  // namespace

ExperimentResult run_experiment(const ExperimentSetup& setup, const std::vector<Piece>& pieces, Rig& rig,
                                SimulatedRigWithHand* hand, Clock& clock, const SignalFlag& signal,
                                const ExperimentOptions& options) {
  ExperimentResult result;
  result.trials = read_trials(options.folder, setup, pieces);
  start_folder(setup, pieces, options.folder);
  ExperimentSetup zeroed = setup;
  bool is_open = false;
  Hand last_hand;
  while (const std::optional<ExperimentTrial> trial = next_trial(pieces, result.trials)) {
    const Piece piece = piece_of(*trial, pieces);
    if (options.announce) options.announce(piece, *trial);
    if (signal.load() != 0) {
      result.sentence = "start the same command again to go on: it was stopped";
      return result;
    }
    // Hardware may have been switched off meanwhile; a simulated rig goes on from where it is.
    if (hand == nullptr || !is_open) rig.open();
    find_zero(rig, clock, zeroed.rig, zero_patience_s);
    if (hand != nullptr) {
      const Hand next = hand_for(piece);
      const bool hands_on =
          next.cart_held || next.holds_s > 0.0 || next.amplifier_off || next.turned || next.push_mps != 0.0;
      const bool changes = last_hand.cart_held || last_hand.amplifier_off || last_hand.turned;
      if (!is_open || hands_on || changes) hand->handle(next);
      last_hand = next;
    }
    is_open = true;
    const ScriptContext context{zeroed.control.period_s(), zeroed.experiment.travel_m,
                                zeroed.rig.amplifier.limit_v, servo_model(zeroed.plant),
                                zeroed.control.gains};
    ExperimentScript script(piece, context);
    RunSetup run = run_setup(zeroed, piece, *trial, options, hand != nullptr, clock.is_virtual());
    run.experiment_text = section_of(zeroed, piece, context);
    SessionOptions session;
    session.out = options.folder;
    session.realtime = options.realtime;
    session.compensator = make_compensator(run.control);
    session.source = &script;
    session.watcher = options.watcher;
    if (options.show) session.show = [&](const LiveStatus& live) { options.show(live, script.phase()); };
    const LoopLimits limits = run.limits;
    const SessionResult done = run_session(std::move(run), rig, clock, signal, std::move(session));
    ++result.made;
    TrialResult judged =
        judge_trial(*trial, piece, read_samples(done.directory / "samples.csv").rows, done.outcome.reason);
    judged.run_directory = done.directory.filename().string();
    if (!is_result(done.outcome.reason, piece)) {
      result.sentence = sentence_of(done.outcome, limits) + "; in " + done.directory.string() +
                        "; the same command goes on with this piece";
      return result;
    }
    result.trials.push_back(judged);
    write_trials(options.folder, pieces, result.trials);
    write_sweep_tables(options.folder, pieces, result.trials);
    if (options.finished) options.finished(judged);
  }
  result.complete = true;
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
