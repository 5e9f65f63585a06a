// `upright report`: one self-contained HTML file for what a path holds.
#include <iostream>
#include <memory>
#include <string>

#include "commands.hpp"
#include "upright/model/error.hpp"
#include "upright/report/diagnosis_report.hpp"
#include "upright/report/experiment_report.hpp"
#include "upright/report/run_report.hpp"
#include "upright/report/sweep_report.hpp"

namespace upright::cli {

namespace {

std::filesystem::path write_report(const std::filesystem::path& path) {
  std::error_code ignored;
  // A file of a run stands for its run.
  const bool is_part = path.filename() == "run.yaml" || path.filename() == "samples.csv";
  const std::filesystem::path directory = is_part ? path.parent_path() / "" : path;
  if (std::filesystem::exists(directory / "run.yaml", ignored)) return write_run_report(directory);
  if (is_diagnosis_folder(path)) return write_diagnosis_report(path);
  if (is_experiment_folder(path)) return write_experiment_report(path);
  if (is_sweep_folder(path)) return write_sweep_report(path);
  if (!std::filesystem::exists(path, ignored))
    throw ConfigError("check the path: there is no " + path.string());
  throw ConfigError("name a folder that `upright run`, `upright sweep` or `upright diagnose` made: " +
                    path.string() + " holds neither run.yaml nor sweep.csv nor diagnosis.json");
}

}  // namespace

void add_report(CommandLine& line) {
  const Command command =
      line.command("report", "One self-contained HTML file for a run, a sweep or a diagnosis",
                   "Example:  upright report runs/20260101T120000Z-run\nPrints the path of the report.");
  const auto path = std::make_shared<std::string>();
  command.option("path", *path, "A run directory, or the folder of a sweep or a diagnosis").required();
  command.does([path] {
    std::cout << write_report(*path).string() << "\n";
    return ExitCode::done;
  });
}

}  // namespace upright::cli
