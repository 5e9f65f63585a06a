// `upright experiment`: a list of pieces on any rig, planned and rehearsed before anything moves.
#include "experiment/experiment.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/angle_units.hpp"
#include "commands.hpp"
#include "commissioning/sign_check.hpp"
#include "experiment/pieces/sign_check.hpp"
#include "live.hpp"
#include "live/row_watchers.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "record/sign_record.hpp"
#include "record/stop_report.hpp"
#include "runtime/overrun_limit.hpp"
#include "signals.hpp"
#include "stop_watcher.hpp"
#include "stream.hpp"
#include "upright/base/error.hpp"
#include "upright/hal/rig_factory.hpp"

namespace upright::cli {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct ExperimentArguments {
  std::string file, rig, plant, out, live_port, stream;
  std::optional<double> rate_hz;
  std::optional<std::uint64_t> seed;
  RealtimeRequest realtime;
  bool fast = false, dry_run = false, ready = false, force = false, as_json = false;
};

bool needs_hands(const Piece& piece) {
  return !piece.operator_does.empty();
}

void refuse_without_hands(const ExperimentSetup& setup, const std::vector<Piece>& pieces, bool ready) {
  if (is_simulated(setup.rig) || ready || ::isatty(STDIN_FILENO) != 0) return;
  const auto at = std::find_if(pieces.begin(), pieces.end(), needs_hands);
  if (at != pieces.end())
    throw ConfigError("the piece " + at->label + " needs an operator to " + at->operator_does +
                      ": start the command in a terminal, or do it first and add --ready");
}

std::string utc_name(const std::string& name) {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[40];
  std::strftime(text, sizeof text, "%Y%m%dT%H%M%SZ", &utc);
  return std::string(text) + "-" + name;
}

/// The folder that was asked for; or one of the same experiment under runs/ that is not finished; or a new
/// one.
fs::path folder_of(const ExperimentArguments& arguments, const ExperimentSetup& setup,
                   const std::vector<Piece>& pieces) {
  if (!arguments.out.empty()) {
    const std::vector<TrialResult> done = read_trials(arguments.out, setup, pieces);
    const std::string missing = missing_transitions(pieces, done);
    if (!done.empty() && !next_trial(pieces, done))
      throw ConfigError(arguments.out + " already holds this experiment, with all runs finished" +
                        (missing.empty() ? "" : " (" + missing + ")") + ": choose another folder with --out");
    return arguments.out;
  }
  const fs::path runs = "runs";
  std::error_code problem;
  for (const fs::directory_entry& entry : fs::directory_iterator(runs, problem)) {
    if (!entry.path().filename().string().ends_with("-" + setup.experiment.name)) continue;
    try {
      const std::vector<TrialResult> done = read_trials(entry.path(), setup, pieces);
      if (fs::exists(entry.path() / "experiment.yaml", problem) && next_trial(pieces, done))
        return entry.path();
    } catch (const Error&) {
      // Another experiment of the same name: not ours to go on with.
    }
  }
  return runs / utc_name(setup.experiment.name);
}

void print_plan(const std::vector<PlannedPiece>& plan, const ExperimentSetup& setup) {
  std::printf("%s: %s\n", setup.experiment.name.c_str(), setup.experiment.why.c_str());
  for (const PlannedPiece& p : plan)
    std::printf("  %-24s %-18s %7.1f s  to %5.0f mm  %5.2f V\n", p.piece.label.c_str(), p.piece.kind->name(),
                p.duration_s, p.farthest_m * 1e3, p.max_v);
  std::fflush(stdout);
}

Json json_of(const std::vector<PlannedPiece>& plan) {
  Json list = Json::array();
  for (const PlannedPiece& p : plan)
    list.push_back({{"piece", p.piece.label},
                    {"kind", p.piece.kind->name()},
                    {"duration_s", p.duration_s},
                    {"farthest_m", p.farthest_m},
                    {"largest_v", p.max_v}});
  return list;
}

/// As `run` does: gains that cannot hold the plant's pendulum are refused where a piece balances.
void refuse_unstable(const ExperimentSetup& setup) {
  std::set<fs::path> judged;
  const auto judge = [&](const fs::path& file, const ControlConfig& control) {
    if (judged.insert(file).second)
      require_stabilized(overrun_limit(setup.plant, control), "the gains of " + file.string());
  };
  for (const Piece& piece : setup.experiment.pieces) {
    if (balances(piece) && !compares(piece)) judge(setup.experiment.gains, setup.control);
    const std::span<const NamedGains> controllers = piece.kind->controllers();
    for (std::size_t k = 0; k < controllers.size(); ++k)
      judge(controllers[k].file, control_of(setup, piece, k));
  }
}

/// The limit that a trial of a balancing piece had; null for the others.
Json overrun_json(const ExperimentSetup& setup, const Piece& piece, const ExperimentTrial& trial) {
  if (!balances(piece)) return nullptr;
  ControlConfig control = control_of(setup, piece, trial.controller);
  control.delay_s = trial.delay_s;
  return overrun_limit(setup.plant, control).max_periods_late;
}

Json json_of(const ExperimentResult& result, const ExperimentSetup& setup, const std::vector<Piece>& pieces,
             const fs::path& folder) {
  Json trials = Json::array();
  for (const TrialResult& r : result.trials) {
    const auto or_null = [](double value) { return std::isnan(value) ? Json(nullptr) : Json(value); };
    const auto text_or_null = [](const std::string& text) {
      return text.empty() ? Json(nullptr) : Json(text);
    };
    trials.push_back({{"piece", pieces[r.trial.piece].label},
                      {"repeat", r.trial.repeat},
                      {"delay_s", r.trial.delay_s},
                      {"run_directory", (folder / r.run_directory).string()},
                      {"reason", r.reason},
                      {"outcome", r.outcome},
                      {"theta0_rad", r.theta0_rad},
                      {"theta_amplitude_rad", r.theta_amplitude_rad},
                      {"cart_amplitude_m", r.cart_amplitude_m},
                      {"frequency_hz", or_null(r.frequency_hz)},
                      {"fall_time_s", or_null(r.fall_time_s)},
                      {"most_periods_late", overrun_json(setup, pieces[r.trial.piece], r.trial)},
                      {"controller", text_or_null(r.controller)},
                      {"gains", text_or_null(r.gains)}});
  }
  return {{"folder", folder.string()},
          {"complete", result.complete},
          {"made", result.made},
          {"zero_volts", name_of_zero(result.stop)},
          {"zero_volts_sentence", sentence_of(result.stop)},
          {"sentence", result.sentence.empty() ? Json(nullptr) : Json(result.sentence)},
          {"trials", trials}};
}

/// The trial in a few words.
std::string words_for(const Piece& piece, const ExperimentTrial& trial) {
  return piece.label + piece.kind->words(trial);
}

void announce(const Piece& piece, const ExperimentTrial& trial, bool simulated, bool ready, bool quiet,
              LiveView* view) {
  std::FILE* out = quiet ? stderr : stdout;
  std::fprintf(out, "%s\n", words_for(piece, trial).c_str());
  std::fflush(out);
  if (simulated) return;
  if (const char* words = piece.kind->request(); *words != '\0') std::fprintf(stderr, "  %s\n", words);
  if (!needs_hands(piece) || ready) return;
  if (view != nullptr)
    view->say({LiveState::Kind::waiting, piece.operator_does + ", then press Enter in the terminal"});
  std::fprintf(stderr, "  %s, then press Enter: ", piece.operator_does.c_str());
  std::string line;
  if (!std::getline(std::cin, line))
    throw Error(ExitCode::stopped,
                "the input ended before Enter was pressed: start the same command again to continue");
}

void show_live(const LiveStatus& live, ScriptPhase phase) {
  std::fprintf(stderr, "\r%8.1f s  %-24s x %+7.1f mm  angle %+8.2f deg  %+6.2f V ", live.time_s.load(),
               words_for(phase), live.cart_m.load() * 1e3, live.theta_rad.load() * degrees_per_radian,
               live.voltage_v.load());
}

/// What the page says while a trial runs.
LiveState state_of(const Piece& piece, const ExperimentTrial& trial, ScriptPhase phase, bool simulated) {
  if (phase != ScriptPhase::waiting || simulated)
    return {LiveState::Kind::running, words_for(piece, trial) + ": " + words_for(phase)};
  return {LiveState::Kind::waiting, piece.kind->request()};
}

/// A sign check's verdict: kept beside the rig file, or the end of the experiment.
void judge_sign_check(const ExperimentSetup& setup, const fs::path& run, bool quiet) {
  const SignFinding finding =
      judge_signs(read_samples(run / "samples.csv").rows, setup.plant.pendulum.has_value());
  if (!finding.agrees) throw Error(ExitCode::stopped, finding.sentence);
  std::fprintf(quiet ? stderr : stdout, "  signs agree: %s\n", finding.sentence.c_str());
  if (is_simulated(setup.rig)) return;
  // The record is of the rig as its file has it, not of the limits of this experiment.
  write_sign_record(read_rig_file(setup.rig.file), finding.sentence);
}

/// The page that --live asks for.
std::unique_ptr<LiveView> open_live(const ExperimentArguments& arguments, const ExperimentSetup& setup) {
  LiveSubject subject;
  subject.title = setup.experiment.name + " on " + setup.rig.file.filename().string();
  subject.rig = &setup.rig;
  subject.plant = &setup.plant;
  subject.period_s = setup.control.period_s();
  subject.realtime = arguments.realtime;
  subject.fast = arguments.fast;
  return open_live(arguments.live_port, subject, arguments.as_json ? stderr : stdout);
}

void print(const TrialResult& r) {
  std::printf("  %s, angle +-%.3f deg, cart +-%.1f mm", r.outcome.c_str(),
              r.theta_amplitude_rad * degrees_per_radian, r.cart_amplitude_m * 1e3);
  if (std::isfinite(r.frequency_hz)) std::printf(", %.2f Hz", r.frequency_hz);
  std::printf("\n");
  std::fflush(stdout);
}

/// The rig of an experiment, and the hand that places the pendulum of a simulated one.
struct AssembledRig {
  std::unique_ptr<Rig> rig;
  SimulatedRigWithHand* hand = nullptr;  ///< null: real hands
};

AssembledRig assemble_rig(const ExperimentSetup& setup, Clock& clock, std::uint64_t seed) {
  if (!is_simulated(setup.rig)) return {make_rig(setup.rig, {setup.control.period_s()})};
  auto plant = make_simulated_rig(setup.rig, clock, {seed, {}});
  SimulatedRigWithHand* const hand = plant.get();
  return {assembled(std::move(plant), setup.rig), hand};
}

/// Runs the pieces that were planned. Seven parameters: all that the command has open by then.
ExperimentResult perform(const ExperimentArguments& arguments, const ExperimentSetup& setup,
                         const std::vector<Piece>& pieces, const fs::path& folder, const SignalFlag& signal,
                         LiveView* view, UdpStream* stream) {
  const bool simulated = is_simulated(setup.rig);
  MonotonicClock real_clock;
  VirtualClock virtual_clock;
  Clock& clock = arguments.fast ? static_cast<Clock&>(virtual_clock) : real_clock;
  const AssembledRig assembly = assemble_rig(setup, clock, arguments.seed.value_or(1));

  ExperimentOptions options;
  options.folder = folder;
  options.command = command_line();
  options.seed = arguments.seed.value_or(1);
  options.realtime = arguments.realtime;
  RowWatchers watchers;
  watchers.add(view);
  watchers.add(stream);
  options.watcher = &watchers;
  options.know_loop = [&](const ControlConfig& control, LoopLimits& limits) {
    const OverrunLimit overrun = overrun_limit(setup.plant, control);
    if (!overrun.warning.empty()) std::cerr << "upright: " << overrun.warning << "\n";
    apply(overrun, limits);
  };
  options.stop = stop_watcher(view);
  std::pair<Piece, ExperimentTrial> current;
  const bool on_terminal = ::isatty(STDERR_FILENO) != 0 && !arguments.fast;
  // On a terminal a trial in real time shows where the cart is instead.
  std::optional<Progress> progress;
  if (!on_terminal) progress.emplace("experiment");
  const auto say = [&](const std::function<void()>& speak) { progress ? progress->aside(speak) : speak(); };
  options.announce = [&](const Piece& piece, const ExperimentTrial& trial) {
    current = {piece, trial};
    say([&] { announce(piece, trial, simulated, arguments.ready, arguments.as_json, view); });
    if (progress) progress->report(trial.piece, pieces.size(), "pieces");
  };
  options.finished = [&](const TrialResult& r) {
    if (on_terminal) std::fputs("\n", stderr);
    if (pieces[r.trial.piece].as<pieces::SignCheck>())
      judge_sign_check(setup, options.folder / r.run_directory, arguments.as_json);
    if (!arguments.as_json && (r.outcome != "done" || !r.controller.empty())) say([&] { print(r); });
  };
  if (on_terminal || view != nullptr)
    options.show = [&](const LiveStatus& live, ScriptPhase phase) {
      if (on_terminal) show_live(live, phase);
      if (view != nullptr) view->say(state_of(current.first, current.second, phase, simulated));
    };
  ExperimentResult result =
      run_experiment(setup, pieces, *assembly.rig, assembly.hand, clock, signal, options);
  if (view != nullptr)
    view->end({result.complete && result.stop.done() ? LiveState::Kind::completed : LiveState::Kind::stopped,
               (result.stop.done() ? "" : sentence_of(result.stop) + ". ") +
                   (result.complete ? "all pieces are done" : result.sentence) + ". The runs are in " +
                   folder.string()});
  return result;
}

ExitCode run(const ExperimentArguments& arguments) {
  const ExperimentSetup setup =
      resolve_experiment(arguments.file, arguments.rig, arguments.plant, arguments.rate_hz);
  const bool simulated = is_simulated(setup.rig);
  if (!simulated) {
    const std::string why = arguments.rig + " is not a simulated rig: remove ";
    if (arguments.fast) throw ConfigError(why + "--fast, or use a simulated rig");
    if (arguments.seed) throw ConfigError(why + "--seed, or use a simulated rig");
  }
  if (!arguments.force) refuse_unstable(setup);
  Progress progress("planning");
  const std::vector<PlannedPiece> plan = rehearse_all(setup, progress.callback());
  progress.end();
  if (arguments.dry_run) {
    if (arguments.as_json)
      std::cout << Json{{"experiment", setup.experiment.name}, {"pieces", json_of(plan)}}.dump(2) << "\n";
    else
      print_plan(plan, setup);
    return ExitCode::done;
  }
  std::vector<Piece> pieces;
  pieces.reserve(plan.size());
  for (const PlannedPiece& planned : plan) pieces.push_back(planned.piece);
  if (!pieces.front().as<pieces::SignCheck>()) require_checked_signs(setup.rig, "");
  refuse_without_hands(setup, pieces, arguments.ready);
  const SignalFlag& signal = catch_signals();
  const fs::path folder = folder_of(arguments, setup, pieces);
  const std::unique_ptr<UdpStream> stream = open_stream(arguments.stream, arguments.fast);
  const std::unique_ptr<LiveView> view = open_live(arguments, setup);
  const ExperimentResult result = shown_by(view.get(), [&] {
    return perform(arguments, setup, pieces, folder, signal, view.get(), stream.get());
  });
  if (arguments.as_json) {
    Json document = json_of(result, setup, pieces, folder);
    add_stream(document, stream.get());
    std::cout << document.dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    print_stream(stream.get());
    std::cout << folder.string() << std::endl;
  }
  if (!result.stop.done()) {
    std::cerr << "upright: " << sentence_of(result.stop) << "\n";
    if (!result.sentence.empty()) std::cerr << "upright: " << result.sentence << "\n";
    return ExitCode::device;
  }
  if (result.complete) return ExitCode::done;
  std::cerr << "upright: " << result.sentence << "\n";
  return ExitCode::stopped;
}

}  // namespace

void add_experiment(CommandLine& line) {
  const Command command = line.command(
      "experiment", "Run a list of measurements on a rig",
      "Example:  upright experiment config/experiments/friction.yaml --rig config/rigs/simulated.yaml "
      "--fast\n"
      "Every piece is planned and rehearsed in simulation before anything moves; --dry-run stops there.\n"
      "The same command resumes an experiment that was interrupted.");
  const auto a = std::make_shared<ExperimentArguments>();
  command.option("file", a->file, "Experiment file").required();
  command.option("--rig", a->rig, "Rig file").required();
  command.option("--plant", a->plant,
                 "Plant file to plan with (default: that of the simulated rig, else that of the experiment)");
  command
      .option("--rate", a->rate_hz,
              "Sample rate [Hz] (default: that of the experiment, else that of the gain file, else 1000)")
      .in(Range::within(lowest_sample_rate_hz, highest_sample_rate_hz));
  add_simulated(command, a->seed, a->fast);
  command.flag("--dry-run", a->dry_run, "Plan and rehearse only; nothing moves");
  command.flag("--force", a->force,
               "Accept gains that do not stabilize the plant, if the rehearsal succeeds with them");
  command.flag("--ready", a->ready,
               "Do not wait for Enter: the operator has already done what the pieces ask for");
  command.option(
      "--out", a->out,
      "Folder of this experiment (default: an unfinished one in runs, else runs/<UTC start>-<name>)");
  add_realtime(command, a->realtime);
  add_live(command, a->live_port);
  add_stream(command, a->stream);
  command.flag("--json", a->as_json, "Print one JSON document");
  command.does([a] { return run(*a); });
}

}  // namespace upright::cli
