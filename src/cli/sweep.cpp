// `upright sweep`: outcomes over starting angle and delay, and the delays at which they change.
#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>

#include "commands.hpp"
#include "json_number.hpp"
#include "progress.hpp"
#include "sweep/mpi_executor.hpp"
#include "upright/base/error.hpp"

namespace upright::cli {

namespace {

std::atomic<bool> stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void ask_to_stop(int) {
  stop_asked = true;
}

/// SIGINT and SIGTERM ask the sweep to stop while one of these lives.
class StopOnSignal {
 public:
  StopOnSignal()
      : interrupt_(std::signal(SIGINT, ask_to_stop)), terminate_(std::signal(SIGTERM, ask_to_stop)) {}
  ~StopOnSignal() {
    std::signal(SIGINT, interrupt_);
    std::signal(SIGTERM, terminate_);
  }
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

 private:
  void (*interrupt_)(int);
  void (*terminate_)(int);
};

struct SweepArguments {
  std::string file, out;
  unsigned threads = 0;
  bool overwrite = false, transitions_only = false, estimate = false, as_json = false;
};

using Json = nlohmann::ordered_json;

/// For each starting angle the largest delay that few of the plants fall at.
Json json_of(const SweepConfig& config, const std::vector<UncertainPoint>& points) {
  Json delays = Json::array();
  for (const ToleratedDelay& delay : tolerated_delays(points, config.uncertainty->samples))
    delays.push_back({{"theta0_rad", delay.theta0_rad},
                      {"delay_s", finite_or_null(delay.delay_s)},
                      {"share_falls", finite_or_null(delay.falls.value)},
                      {"low", finite_or_null(delay.falls.low)},
                      {"high", finite_or_null(delay.falls.high)}});
  return {{"fewer_than_5_percent_fall_up_to", delays},
          {"samples", config.uncertainty->samples},
          {"seed", config.uncertainty->seed}};
}

Json json_of(const SweepConfig& config, const SweepResult& result, const std::string& folder) {
  std::array<std::size_t, 3> counts{};
  for (const SweepRun& run : result.runs)
    ++counts[static_cast<std::size_t>(run.outcome(config.stable_below_rad))];
  Json transitions = Json::array();
  for (const Transition& t : result.transitions)
    transitions.push_back({{"theta0_rad", t.theta0_rad},
                           {"oscillates_from_s", finite_or_null(t.oscillates_from_s)},
                           {"falls_from_s", finite_or_null(t.falls_from_s)}});
  Json document;
  if (!result.uncertain.empty()) document["uncertainty"] = json_of(config, result.uncertain);
  const Json plain = {{"folder", folder},           {"finished", !result.interrupted},
                      {"runs", result.runs.size()}, {"runs_made", result.runs_made},
                      {"stable", counts[0]},        {"oscillating", counts[1]},
                      {"fell", counts[2]},          {"transitions", transitions}};
  document.update(plain);
  return document;
}

std::string milliseconds_cell(double value_s) {
  if (value_s != value_s) return "     -";
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%6.1f", 1e3 * value_s);
  return text.data();
}

void print(const std::vector<UncertainPoint>& points, std::uint32_t samples) {
  std::printf("theta0 [deg]   fewer than 5 percent of %u plants fall up to [ms]\n", samples);
  for (const ToleratedDelay& t : tolerated_delays(points, samples))
    std::printf("%12.4f   %46s\n", t.theta0_rad * 57.29577951308232, milliseconds_cell(t.delay_s).c_str());
}

void print(const SweepConfig& config, const SweepResult& result, const std::string& folder) {
  if (!result.uncertain.empty()) print(result.uncertain, config.uncertainty->samples);
  std::printf("theta0 [deg]   oscillates from [ms]   falls from [ms]\n");
  for (const Transition& t : result.transitions)
    std::printf("%12.4f   %20s   %15s\n", t.theta0_rad * 57.29577951308232,
                milliseconds_cell(t.oscillates_from_s).c_str(), milliseconds_cell(t.falls_from_s).c_str());
  std::printf("%zu runs simulated, results in %s\n", result.runs_made, folder.c_str());
  std::fflush(stdout);
}

/// The threads of all ranks.
unsigned workers(const SweepArguments& arguments, const MpiExecutor& ranks) {
  if (ranks.count() > 1) return static_cast<unsigned>(ranks.count()) * std::max(1u, arguments.threads);
  return arguments.threads != 0 ? arguments.threads : std::max(1u, std::thread::hardware_concurrency());
}

std::string text_of(const SweepEstimate& estimate, unsigned workers) {
  const double all_s = static_cast<double>(estimate.runs) * estimate.run_s;
  std::array<char, 160> text;
  std::snprintf(text.data(), text.size(), "%zu runs of %.3g ms of processor time: about %s on %u thread%s",
                estimate.runs, 1e3 * estimate.run_s, duration_text(all_s / workers).c_str(), workers,
                workers == 1 ? "" : "s");
  return text.data();
}

/// Says how long the sweep will take, and runs nothing else.
ExitCode estimate_only(const SweepConfig& config, const SweepArguments& arguments, unsigned workers) {
  const SweepEstimate estimate = estimate_sweep(config);
  const double all_s = static_cast<double>(estimate.runs) * estimate.run_s;
  if (arguments.as_json)
    std::cout << Json({{"time_s", all_s / workers},
                       {"threads", workers},
                       {"runs", estimate.runs},
                       {"processor_s_per_run", estimate.run_s}})
                     .dump(2)
              << "\n";
  else
    std::cout << text_of(estimate, workers) << "\n";
  return ExitCode::done;
}

ExitCode run_here(const SweepConfig& config, const SweepArguments& arguments, const MpiExecutor& ranks) {
  const std::string folder = !arguments.out.empty()
                                 ? arguments.out
                                 : "runs/sweep-" + std::filesystem::path(arguments.file).stem().string();
  stop_asked = false;
  SweepOptions options;
  options.overwrite = arguments.overwrite;
  options.transitions_only = arguments.transitions_only;
  options.stop = &stop_asked;
  const std::unique_ptr<SweepExecutor> executor = ranks.make_executor(config, arguments.threads);
  const unsigned threads = workers(arguments, ranks);
  if (arguments.estimate) return estimate_only(config, arguments, threads);
  SweepResult result;
  {
    const StopOnSignal on_signal;
    Progress progress("sweep");
    options.estimated = [&progress, threads](const SweepEstimate& remaining) {
      progress.aside(
          [&] { std::fprintf(stderr, "upright: sweep: %s\n", text_of(remaining, threads).c_str()); });
    };
    options.progress = [&progress](std::size_t done, std::size_t known) {
      progress.report(done, known, "runs");
    };
    result = run_sweep(config, folder, options, *executor);
  }
  if (arguments.as_json)
    std::cout << json_of(config, result, folder).dump(2) << "\n";
  else if (!result.interrupted)
    print(config, result, folder);
  if (!result.interrupted) return ExitCode::done;
  throw Error(ExitCode::stopped, "the sweep was stopped after " + std::to_string(result.runs_made) +
                                     " runs, which are kept in " + folder +
                                     ": start the same command again to continue");
}

/// On the ranks other than the first.
ExitCode run_elsewhere(const SweepConfig& config, const SweepArguments& arguments, const MpiExecutor& ranks) {
  const StopOnSignal until_the_first_lets_go;
  try {
    ranks.serve(config, arguments.threads);
  } catch (const Error& error) {
    return error.code();
  }
  return ExitCode::done;
}

/// The first rank speaks, of errors too. The others end without one then: mpirun ends the first as soon as
/// another ends with an error.
ExitCode run(const SweepArguments& arguments) {
  const MpiExecutor ranks;
  std::optional<SweepConfig> config;
  std::exception_ptr problem;
  try {
    config = read_sweep_file(arguments.file);
  } catch (const Error&) {
    problem = std::current_exception();
  }
  const int failed = ranks.first_failed(problem != nullptr);
  if (!ranks.first())
    return failed == ranks.count() ? run_elsewhere(*config, arguments, ranks) : ExitCode::done;
  if (problem) std::rethrow_exception(problem);
  if (failed < ranks.count())
    throw ConfigError("rank " + std::to_string(failed) + " of mpirun cannot read " + arguments.file +
                      ": each machine needs the sweep file and its plant at the same path");
  return run_here(*config, arguments, ranks);
}

}  // namespace

void add_sweep(CommandLine& line) {
  const Command command = line.command(
      "sweep", "Simulate a grid of starting angles and delays: stable, oscillating or fallen",
      "Example:  upright sweep config/sweeps/exponential.yaml --out runs/map && upright report runs/map\n"
      "Ctrl-C stops the sweep and keeps the finished runs. The same command continues it.");
  const auto arguments = std::make_shared<SweepArguments>();
  command.option("sweep", arguments->file, "Sweep file").required();
  command.option("--out", arguments->out, "Folder for the results (default: runs/sweep-NAME)");
  command.option("--threads", arguments->threads, "Number of threads (default: one per processor)")
      .from_to(1u, 1024u);
  command.flag(
      "--transitions-only", arguments->transitions_only,
      "Search only for the delays at which the outcome changes, without the grid and its drawn plants");
  command.flag("--estimate", arguments->estimate, "Only print how long the sweep will take");
  command.flag("--overwrite", arguments->overwrite, "Replace existing results in the folder");
  command.flag("--json", arguments->as_json, "Print one JSON document");
  command.does([arguments] { return run(*arguments); });
}

}  // namespace upright::cli
