// `upright report`: one self-contained HTML file for what each path holds.
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "commands.hpp"
#include "progress.hpp"
#include "report/diagnosis_report.hpp"
#include "report/experiment_report.hpp"
#include "report/run_report.hpp"
#include "report/sweep_report.hpp"
#include "upright/base/error.hpp"

namespace upright::cli {

namespace {

namespace fs = std::filesystem;

struct ReportFlags {
  std::vector<std::string> paths;
  std::string out = "runs";
  bool latest = false;
};

fs::path write_report(const fs::path& path, const ProgressCallback& progress) {
  std::error_code ignored;
  // A file of a run stands for its run.
  const bool is_part = path.filename() == "run.yaml" || path.filename() == "samples.csv";
  const fs::path directory = is_part ? path.parent_path() / "" : path;
  if (fs::exists(directory / "run.yaml", ignored)) return write_run_report(directory, progress);
  if (is_diagnosis_folder(path)) return write_diagnosis_report(path);
  if (is_experiment_folder(path)) return write_experiment_report(path);
  if (is_sweep_folder(path)) return write_sweep_report(path);
  if (!fs::exists(path, ignored))
    throw ConfigError(path.string() + " does not exist: check the path, or use --latest");
  throw ConfigError(path.string() +
                    " contains no run.yaml, sweep.csv, diagnosis.json or trials.csv: name a folder that "
                    "`upright run`, `experiment`, `sweep` or `diagnose` wrote");
}

/// The run that began last in a folder of runs. Their names begin with the second of their start; within a
/// second the later file decides.
fs::path newest_run_in(const fs::path& folder) {
  using Age = std::tuple<std::string, fs::file_time_type, fs::path>;
  constexpr std::size_t start_length = 16;  // 20260101T120000Z
  std::optional<Age> newest;
  std::error_code problem;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, problem)) {
    std::error_code ignored;
    const fs::path file = entry.path() / "run.yaml";
    if (!fs::is_regular_file(file, ignored)) continue;
    const Age age{entry.path().filename().string().substr(0, start_length),
                  fs::last_write_time(file, ignored), entry.path()};
    if (!newest || *newest < age) newest = age;
  }
  if (!newest)
    throw ConfigError(folder.string() +
                      " contains no run: name the folder that contains the runs with --out");
  return std::get<fs::path>(*newest);
}

/// One line for each report. With several paths a bad one does not keep the others from theirs; the exit code
/// is that of the first failure.
ExitCode write_reports(const ReportFlags& flags) {
  std::vector<fs::path> paths(flags.paths.begin(), flags.paths.end());
  if (flags.latest) paths.push_back(newest_run_in(flags.out));
  if (paths.empty()) throw ConfigError("no path was given: name a run directory, or use --latest");
  ExitCode code = ExitCode::done;
  Progress progress("report");
  double written = 0.0;
  const auto all = static_cast<double>(paths.size());
  for (const fs::path& path : paths) {
    const auto of_all = [&](double share, const std::string& what) {
      progress.report((written + share) / all, what);
    };
    of_all(0.0, path.string());
    try {
      const fs::path report = write_report(path, of_all);
      progress.aside([&] { std::cout << report.string() << std::endl; });
    } catch (const Error& error) {
      if (paths.size() == 1) throw;
      progress.aside([&] { std::cerr << "upright: " << error.what() << std::endl; });
      if (code == ExitCode::done) code = error.code();
    }
    written += 1.0;
  }
  return code;
}

}  // namespace

void add_report(CommandLine& line) {
  const Command command = line.command(
      "report", "Write one self-contained HTML file for each run, experiment, sweep or diagnosis",
      "Example:  upright report --latest\n"
      "          upright report runs/*-run\n"
      "Prints the path of each report.");
  const auto flags = std::make_shared<ReportFlags>();
  command.option("path", flags->paths, "Run directories, or folders of experiments, sweeps or diagnoses");
  command.flag("--latest", flags->latest, "Report on the run that started last");
  command.option("--out", flags->out, "Folder in which --latest looks for runs (default: runs)");
  command.does([flags] { return write_reports(*flags); });
}

}  // namespace upright::cli
