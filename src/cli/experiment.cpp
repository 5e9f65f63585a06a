// `upright experiment`: a list of pieces on any rig, planned and rehearsed before anything moves.
#include "upright/runtime/experiment.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "live.hpp"
#include "options.hpp"
#include "signals.hpp"
#include "upright/hal/gpio_rig.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/model/error.hpp"
#include "upright/runtime/sign_check.hpp"

namespace upright::cli {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double degrees_per_rad = 180.0 / std::numbers::pi;

struct Arguments {
  std::string file, rig, plant, out, live_port;
  std::optional<double> rate_hz;
  std::optional<std::uint64_t> seed;
  RealtimeRequest realtime;
  bool fast = false, dry_run = false, ready = false, as_json = false;
};

bool needs_hands(const Piece& piece) {
  return !piece.operator_does.empty();
}

void refuse_unchecked_signs(const ExperimentSetup& setup, const std::vector<Piece>& pieces) {
  if (is_simulated(setup.rig) || pieces.front().kind == PieceKind::sign_check || signs_are_checked(setup.rig))
    return;
  throw ConfigError("run upright experiment config/experiments/sign-check.yaml --rig " +
                    setup.rig.file.string() + " first: no sign check was done on this rig as it is wired (" +
                    sign_record_of(setup.rig).string() + ")");
}

void refuse_without_hands(const ExperimentSetup& setup, const std::vector<Piece>& pieces, bool ready) {
  if (is_simulated(setup.rig) || ready || ::isatty(STDIN_FILENO) != 0) return;
  const auto at = std::find_if(pieces.begin(), pieces.end(), needs_hands);
  if (at != pieces.end())
    throw ConfigError("start it on a terminal, or give --ready when it is done: the piece " + at->label +
                      " needs somebody to " + at->operator_does);
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
fs::path folder_of(const Arguments& arguments, const ExperimentSetup& setup,
                   const std::vector<Piece>& pieces) {
  if (!arguments.out.empty()) {
    const std::vector<TrialResult> done = read_trials(arguments.out, setup, pieces);
    if (!done.empty() && !next_trial(pieces, done))
      throw ConfigError("choose another folder with --out: " + arguments.out +
                        " holds this experiment, complete");
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

struct PlanLine {
  std::string label, kind;
  double duration_s = 0.0, farthest_m = 0.0, most_v = 0.0;
};

std::vector<PlanLine> plan_lines(const std::vector<Piece>& pieces, const ExperimentSetup& setup) {
  std::vector<PlanLine> lines;
  for (Piece piece : pieces) {
    if (piece.kind == PieceKind::delay_sweep) piece.delay_s = piece.delays_s.front();
    const Rehearsal r = rehearse(piece, setup);
    PlanLine line{piece.label, name_of(piece.kind), r.outcome.time_s, r.farthest_m, 0.0};
    for (const LogRecord& row : r.rows) line.most_v = std::max(line.most_v, std::abs(row.voltage_v));
    lines.push_back(line);
  }
  return lines;
}

void print_plan(const std::vector<PlanLine>& lines, const ExperimentSetup& setup) {
  std::printf("%s: %s\n", setup.experiment.name.c_str(), setup.experiment.why.c_str());
  for (const PlanLine& line : lines)
    std::printf("  %-24s %-18s %7.1f s  to %5.0f mm  %5.2f V\n", line.label.c_str(), line.kind.c_str(),
                line.duration_s, line.farthest_m * 1e3, line.most_v);
  std::fflush(stdout);
}

Json json_of(const std::vector<PlanLine>& lines) {
  Json list = Json::array();
  for (const PlanLine& line : lines)
    list.push_back({{"piece", line.label},
                    {"kind", line.kind},
                    {"duration_s", line.duration_s},
                    {"farthest_m", line.farthest_m},
                    {"largest_v", line.most_v}});
  return list;
}

Json json_of(const ExperimentResult& result, const std::vector<Piece>& pieces, const fs::path& folder) {
  Json trials = Json::array();
  for (const TrialResult& r : result.trials) {
    const auto or_null = [](double value) { return std::isnan(value) ? Json(nullptr) : Json(value); };
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
                      {"fall_time_s", or_null(r.fall_time_s)}});
  }
  return {{"folder", folder.string()},
          {"complete", result.complete},
          {"made", result.made},
          {"sentence", result.sentence.empty() ? Json(nullptr) : Json(result.sentence)},
          {"trials", trials}};
}

const char* lifting_words(const Piece& piece) {
  if (piece.kind == PieceKind::free_decay)
    return "hold the cart, lift the pendulum aside and keep it still; let go after a second";
  if (balances(piece) && piece.start == StartBy::hand)
    return "when the cart stands in the middle, lift the pendulum upright and hold it still until it "
           "balances";
  if (piece.kind == PieceKind::sign_check) return "let the pendulum hang still, the cart near the middle";
  return "";
}

/// The trial in a few words.
std::string words_for(const Piece& piece, const ExperimentTrial& trial) {
  if (piece.kind != PieceKind::delay_sweep) return piece.label;
  char text[64];
  std::snprintf(text, sizeof text, ": delay %.3f ms, repeat %d", trial.delay_s * 1e3, trial.repeat + 1);
  return piece.label + text;
}

void announce(const Piece& piece, const ExperimentTrial& trial, bool simulated, bool ready, bool quiet,
              LiveView* view) {
  std::FILE* out = quiet ? stderr : stdout;
  std::fprintf(out, "%s\n", words_for(piece, trial).c_str());
  std::fflush(out);
  if (simulated) return;
  if (const char* words = lifting_words(piece); *words != '\0') std::fprintf(stderr, "  %s\n", words);
  if (!needs_hands(piece) || ready) return;
  if (view != nullptr)
    view->say({LiveState::Kind::waiting, piece.operator_does + ", then press Enter in the terminal"});
  std::fprintf(stderr, "  %s, then press Enter: ", piece.operator_does.c_str());
  std::string line;
  if (!std::getline(std::cin, line))
    throw Error(ExitCode::stopped, "start the same command again to go on: nobody pressed Enter");
}

void show_live(const LiveStatus& live, ScriptPhase phase) {
  std::fprintf(stderr, "\r%8.1f s  %-24s x %+7.1f mm  angle %+8.2f deg  %+6.2f V ", live.time_s.load(),
               words_for(phase), live.cart_m.load() * 1e3, live.theta_rad.load() * degrees_per_rad,
               live.voltage_v.load());
}

/// What the page says while a trial runs.
LiveState state_of(const Piece& piece, const ExperimentTrial& trial, ScriptPhase phase, bool simulated) {
  if (phase != ScriptPhase::waiting || simulated)
    return {LiveState::Kind::running, words_for(piece, trial) + ": " + words_for(phase)};
  return {LiveState::Kind::waiting, lifting_words(piece)};
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
std::unique_ptr<LiveView> open_live(const Arguments& arguments, const ExperimentSetup& setup) {
  LiveSubject subject;
  subject.title = setup.experiment.name + " on " + setup.rig.file.filename().string();
  subject.rig = &setup.rig;
  subject.plant = &setup.plant;
  subject.period_s = setup.control.period_s();
  subject.realtime = arguments.realtime;
  subject.fast = arguments.fast;
  return open_live(arguments.live_port, subject, arguments.as_json ? stderr : stdout);
}

/// Runs the pieces that were planned.
ExperimentResult perform(const Arguments& arguments, const ExperimentSetup& setup,
                         const std::vector<Piece>& pieces, const fs::path& folder, const SignalFlag& signal,
                         LiveView* view) {
  const bool simulated = is_simulated(setup.rig);
  MonotonicClock real_clock;
  VirtualClock virtual_clock;
  Clock& clock = arguments.fast ? static_cast<Clock&>(virtual_clock) : real_clock;
  SimulatedRigWithHand* hand = nullptr;
  std::unique_ptr<Rig> rig;
  if (simulated) {
    auto plant = make_simulated_rig(setup.rig, clock, {arguments.seed.value_or(1), {}});
    hand = plant.get();
    rig = with_gpio_lines(std::move(plant), setup.rig);
  } else {
    rig = make_rig(setup.rig, {setup.control.period_s()});
  }

  ExperimentOptions options;
  options.folder = folder;
  options.command = command_line();
  options.seed = arguments.seed.value_or(1);
  options.realtime = arguments.realtime;
  options.watcher = view;
  std::pair<Piece, ExperimentTrial> current;
  const bool on_terminal = ::isatty(STDERR_FILENO) != 0 && !arguments.fast;
  options.announce = [&](const Piece& piece, const ExperimentTrial& trial) {
    current = {piece, trial};
    announce(piece, trial, simulated, arguments.ready, arguments.as_json, view);
  };
  options.finished = [&](const TrialResult& r) {
    if (on_terminal) std::fputs("\n", stderr);
    if (pieces[r.trial.piece].kind == PieceKind::sign_check)
      judge_sign_check(setup, options.folder / r.run_directory, arguments.as_json);
    if (arguments.as_json || r.outcome == "done") return;
    std::printf("  %s, angle +-%.3f deg, cart +-%.1f mm", r.outcome.c_str(),
                r.theta_amplitude_rad * degrees_per_rad, r.cart_amplitude_m * 1e3);
    if (std::isfinite(r.frequency_hz)) std::printf(", %.2f Hz", r.frequency_hz);
    std::printf("\n");
    std::fflush(stdout);
  };
  if (on_terminal || view != nullptr)
    options.show = [&](const LiveStatus& live, ScriptPhase phase) {
      if (on_terminal) show_live(live, phase);
      if (view != nullptr) view->say(state_of(current.first, current.second, phase, simulated));
    };
  ExperimentResult result = run_experiment(setup, pieces, *rig, hand, clock, signal, options);
  if (view != nullptr)
    view->end({result.complete ? LiveState::Kind::completed : LiveState::Kind::stopped,
               (result.complete ? "every piece is done" : result.sentence) + ". The runs are in " +
                   folder.string()});
  return result;
}

ExitCode run(const Arguments& arguments) {
  const ExperimentSetup setup =
      resolve_experiment(arguments.file, arguments.rig, arguments.plant, arguments.rate_hz);
  const bool simulated = is_simulated(setup.rig);
  if (!simulated) {
    const std::string why = ": " + arguments.rig + " is not a simulated rig";
    if (arguments.fast) throw ConfigError("remove --fast, or name a simulated rig" + why);
    if (arguments.seed) throw ConfigError("remove --seed, or name a simulated rig" + why);
  }
  const std::vector<Piece> pieces = plan_pieces(setup);
  if (arguments.dry_run) {
    const std::vector<PlanLine> lines = plan_lines(pieces, setup);
    if (arguments.as_json)
      std::cout << Json{{"experiment", setup.experiment.name}, {"pieces", json_of(lines)}}.dump(2) << "\n";
    else
      print_plan(lines, setup);
    return ExitCode::done;
  }
  refuse_unchecked_signs(setup, pieces);
  refuse_without_hands(setup, pieces, arguments.ready);
  const SignalFlag& signal = catch_signals();
  const fs::path folder = folder_of(arguments, setup, pieces);
  const std::unique_ptr<LiveView> view = open_live(arguments, setup);
  const ExperimentResult result =
      shown_by(view.get(), [&] { return perform(arguments, setup, pieces, folder, signal, view.get()); });
  if (arguments.as_json)
    std::cout << json_of(result, pieces, folder).dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
  else
    std::cout << folder.string() << std::endl;
  if (result.complete) return ExitCode::done;
  std::cerr << "upright: " << result.sentence << "\n";
  return ExitCode::stopped;
}

}  // namespace

void add_experiment(CommandLine& line) {
  const Command command = line.command(
      "experiment", "Run a list of measurements on a rig, unattended",
      "Example:  upright experiment config/experiments/friction.yaml --rig config/rigs/simulated.yaml "
      "--fast\n"
      "Every piece is planned and rehearsed on a simulated rig before anything moves; --dry-run ends there.\n"
      "The same command goes on where an interrupted one stopped.");
  const auto a = std::make_shared<Arguments>();
  command.option("file", a->file, "Experiment file").required();
  command.option("--rig", a->rig, "Rig file").required();
  command.option("--plant", a->plant, "Plant file to plan with (the experiment's, the simulated rig's)");
  command.option("--rate", a->rate_hz, "Sample rate [Hz] (the experiment's, the gain file's, 1000)")
      .in(Range::within(lowest_sample_rate_hz, highest_sample_rate_hz));
  add_simulated(command, a->seed, a->fast);
  command.flag("--dry-run", a->dry_run, "Plan and rehearse, then stop: nothing moves");
  command.flag("--ready", a->ready, "What pieces ask of an operator is done: do not wait for Enter");
  command.option("--out", a->out, "Folder of this experiment (runs/<UTC start>-<name>)");
  add_realtime(command, a->realtime);
  add_live(command, a->live_port);
  command.flag("--json", a->as_json, "One JSON document");
  command.does([a] { return run(*a); });
}

}  // namespace upright::cli
