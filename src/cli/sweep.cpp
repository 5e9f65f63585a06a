// `upright sweep`: outcomes over starting angle and delay, and the delays at which they change.
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

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
  bool overwrite = false, transitions_only = false, as_json = false;
};

using Json = nlohmann::ordered_json;

Json json_of(const SweepConfig& config, const SweepResult& result, const std::string& folder) {
  std::array<std::size_t, 3> counts{};
  for (const SweepRun& run : result.runs)
    ++counts[static_cast<std::size_t>(run.outcome(config.stable_below_rad))];
  Json transitions = Json::array();
  for (const Transition& t : result.transitions)
    transitions.push_back({{"theta0_rad", t.theta0_rad},
                           {"oscillates_from_s", finite_or_null(t.oscillates_from_s)},
                           {"falls_from_s", finite_or_null(t.falls_from_s)}});
  return {{"folder", folder},           {"finished", !result.interrupted},
          {"runs", result.runs.size()}, {"runs_made", result.runs_made},
          {"stable", counts[0]},        {"oscillating", counts[1]},
          {"fell", counts[2]},          {"transitions", transitions}};
}

std::string milliseconds_cell(double value_s) {
  if (value_s != value_s) return "     -";
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%6.1f", 1e3 * value_s);
  return text.data();
}

void print(const SweepResult& result, const std::string& folder) {
  std::printf("theta0 [deg]   oscillates from [ms]   falls from [ms]\n");
  for (const Transition& t : result.transitions)
    std::printf("%12.4f   %20s   %15s\n", t.theta0_rad * 57.29577951308232,
                milliseconds_cell(t.oscillates_from_s).c_str(), milliseconds_cell(t.falls_from_s).c_str());
  std::printf("%zu runs simulated, results in %s\n", result.runs_made, folder.c_str());
  std::fflush(stdout);
}

ExitCode run_here(const SweepArguments& arguments, const MpiExecutor& ranks) {
  const SweepConfig config = read_sweep_file(arguments.file);
  const std::string folder = !arguments.out.empty()
                                 ? arguments.out
                                 : "runs/sweep-" + std::filesystem::path(arguments.file).stem().string();
  stop_asked = false;
  SweepOptions options;
  options.overwrite = arguments.overwrite;
  options.transitions_only = arguments.transitions_only;
  options.stop = &stop_asked;
  const std::unique_ptr<SweepExecutor> executor = ranks.make_executor(config, arguments.threads);
  SweepResult result;
  {
    const StopOnSignal on_signal;
    Progress progress("sweep");
    options.progress = [&progress](std::size_t done, std::size_t known) {
      progress.report(done, known, "runs");
    };
    result = run_sweep(config, folder, options, *executor);
  }
  if (arguments.as_json)
    std::cout << json_of(config, result, folder).dump(2) << "\n";
  else if (!result.interrupted)
    print(result, folder);
  if (!result.interrupted) return ExitCode::done;
  throw Error(ExitCode::stopped, "the sweep was stopped after " + std::to_string(result.runs_made) +
                                     " runs, which are kept in " + folder +
                                     ": start the same command again to continue");
}

/// On the ranks other than the first: it is the first that speaks, of errors too.
ExitCode run_elsewhere(const SweepArguments& arguments, const MpiExecutor& ranks) {
  const StopOnSignal until_the_first_lets_go;
  try {
    ranks.serve(read_sweep_file(arguments.file), arguments.threads);
  } catch (const Error& error) {
    return error.code();
  }
  return ExitCode::done;
}

ExitCode run(const SweepArguments& arguments) {
  const MpiExecutor ranks;
  return ranks.first() ? run_here(arguments, ranks) : run_elsewhere(arguments, ranks);
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
  command.flag("--transitions-only", arguments->transitions_only,
               "Search only for the delays at which the outcome changes, without the whole grid");
  command.flag("--overwrite", arguments->overwrite, "Replace existing results in the folder");
  command.flag("--json", arguments->as_json, "Print one JSON document");
  command.does([arguments] { return run(*arguments); });
}

}  // namespace upright::cli
