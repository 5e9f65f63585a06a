// `upright compare`: what differs between runs.
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/number_text.hpp"
#include "commands.hpp"
#include "comparison/paired_comparison.hpp"
#include "comparison/run_behaviour.hpp"
#include "options.hpp"
#include "report/compare_report.hpp"
#include "report/paired_report.hpp"
#include "upright/base/error.hpp"

namespace upright::cli {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct CompareFlags {
  std::vector<std::string> runs;
  std::string out;
  bool as_json = false;
};

Json json_of(const RunBehaviour& run) {
  Json json = {{"run", run.run.string()},
               {"sample_rate_hz", run.sample_rate_hz},
               {"from_s", run.from_s},
               {"to_s", run.to_s},
               {"rows", run.rows}};
  for (std::size_t k = 0; k < quantities.size(); ++k) {
    const std::string key(quantities[k].key);
    const Estimate* estimate = run.behaviour ? &run.behaviour->values[k] : nullptr;
    json[key] = estimate != nullptr ? Json(estimate->value) : Json(nullptr);
    json[key + "_ci95"] = estimate != nullptr && estimate->ci95 ? Json(*estimate->ci95) : Json(nullptr);
  }
  json["falls"] = run.fell ? 1 : 0;
  json["result"] = run.result;
  json["sentence"] = run.sentence;
  json["ended_s"] = run.ended_s;
  json["lateness_us"] = nullptr;
  if (run.lateness)
    json["lateness_us"] = {{"median", run.lateness->median_us},
                           {"p99", run.lateness->p99_us},
                           {"largest", run.lateness->largest_us}};
  json["problem"] = run.problem.empty() ? Json(nullptr) : Json(run.problem);
  return json;
}

Json json_of(const std::vector<RunBehaviour>& runs) {
  Json list = Json::array(), differences = Json::array();
  for (const RunBehaviour& run : runs) list.push_back(json_of(run));
  for (std::size_t k = 1; k < runs.size(); ++k)
    for (const Difference& d : differences_between(runs.front(), runs[k]))
      differences.push_back({{"run", runs[k].run.string()},
                             {"against", runs.front().run.string()},
                             {"quantity", quantities[d.quantity].key},
                             {"from", d.from},
                             {"to", d.to},
                             {"clear", d.is_clear ? Json(*d.is_clear) : Json(nullptr)}});
  return {{"window", "the last third of each run"},
          {"intervals", "95 percent, from batches of at least 1 s"},
          {"runs", list},
          {"differences", differences}};
}

std::string cell(const RunBehaviour& run, std::size_t quantity) {
  if (!run.behaviour) return "-";
  const Estimate& estimate = run.behaviour->values[quantity];
  const double scale = quantities[quantity].per_si_unit;
  std::string text = number_text(scale * estimate.value, 3);
  if (estimate.ci95)
    text += " (" + number_text(scale * (*estimate.ci95)[0], 3) + " to " +
            number_text(scale * (*estimate.ci95)[1], 3) + ")";
  return text;
}

void print(const std::vector<RunBehaviour>& runs) {
  for (const std::string& sentence : comparison_sentences(runs)) std::cout << sentence << "\n";
  std::printf(
      "\nLast third of each run, with 95 percent confidence intervals:\n%-5s %-22s %-22s %-22s %-22s %-24s "
      "%s\n",
      "run", "cart [mm p-p]", "angle [deg p-p]", "voltage [V rms]", "steps [V rms]",
      "late [us] 50, 99 %, max", "folder");
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const RunBehaviour& run = runs[k];
    std::string late = "virtual time";
    if (run.lateness)
      late = number_text(run.lateness->median_us, 3) + ", " + number_text(run.lateness->p99_us, 3) + ", " +
             number_text(run.lateness->largest_us, 3);
    std::printf("%-5s %-22s %-22s %-22s %-22s %-24s %s\n", run_letter(k).c_str(), cell(run, 0).c_str(),
                cell(run, 1).c_str(), cell(run, 2).c_str(), cell(run, 3).c_str(), late.c_str(),
                run.run.string().c_str());
  }
}

Json json_of(const PairedDifference& d) {
  return {{"quantity", quantities[d.quantity].key},
          {"from", d.from},
          {"to", d.to},
          {"difference", d.difference.value},
          {"difference_ci95", d.difference.ci95 ? Json(*d.difference.ci95) : Json(nullptr)},
          {"clear", d.difference.ci95 ? Json(d.is_clear()) : Json(nullptr)}};
}

Json json_of(const PieceComparison& piece) {
  Json runs = Json::array(), comparisons = Json::array();
  for (const ComparedRun& run : piece.runs) {
    Json json = json_of(run.behaviour);
    json["controller"] = run.controller;
    json["round"] = run.round + 1;
    runs.push_back(json);
  }
  for (const ControllerComparison& other : piece.others) {
    Json differences = Json::array();
    for (const PairedDifference& d : other.differences) differences.push_back(json_of(d));
    comparisons.push_back({{"controller", other.controller},
                           {"against", piece.first_controller},
                           {"rounds", other.rounds},
                           {"falls", other.falls},
                           {"differences", differences}});
  }
  return {{"piece", piece.label},
          {"first_falls", piece.first_falls},
          {"comparisons", comparisons},
          {"runs", runs}};
}

/// An experiment in which controllers took turns.
ExitCode compare_rounds(const fs::path& experiment, const std::string& page, bool as_json) {
  const std::vector<PieceComparison> pieces = paired_comparisons(experiment);
  if (pieces.empty())
    throw ConfigError("no run of " + experiment.string() +
                      " belongs to a piece that compares controllers: name run directories instead, or "
                      "list several gains in a piece of the experiment");
  if (!page.empty()) write_paired_report(experiment, pieces, page);
  if (as_json) {
    Json list = Json::array();
    for (const PieceComparison& piece : pieces) list.push_back(json_of(piece));
    const Json document = {{"experiment", experiment.string()},
                           {"window", "the last third of each run"},
                           {"intervals", "95 percent, paired t-test over the rounds"},
                           {"pieces", list}};
    std::cout << document.dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
    return ExitCode::done;
  }
  for (const PieceComparison& piece : pieces) {
    std::cout << piece.label << "\n";
    for (const std::string& sentence : paired_sentences(piece)) std::cout << "  " << sentence << "\n";
  }
  std::cout << paired_interval_words << "\nWritten: " << page << std::endl;
  return ExitCode::done;
}

/// A file of a run stands for its run.
fs::path run_of(const fs::path& path) {
  const bool is_part = path.filename() == "run.yaml" || path.filename() == "samples.csv";
  return is_part ? path.parent_path() / "" : path;
}

ExitCode compare(const CompareFlags& flags) {
  const std::string page = flags.out.empty() && !flags.as_json ? "compare.html" : flags.out;
  for (const std::string& path : flags.runs) {
    if (!holds_experiment(path)) continue;
    if (flags.runs.size() > 1)
      throw ConfigError(
          path +
          " is an experiment folder, which cannot be compared with other paths: name it alone, or name "
          "run directories");
    return compare_rounds(path, page, flags.as_json);
  }
  std::vector<RunBehaviour> runs;
  for (const std::string& path : flags.runs) runs.push_back(behaviour_of_run(run_of(path)));
  if (!page.empty()) write_compare_report(runs, page);
  if (flags.as_json) {
    std::cout << json_of(runs).dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
    return ExitCode::done;
  }
  print(runs);
  std::printf("Written: %s\n", page.c_str());
  std::fflush(stdout);
  return ExitCode::done;
}

}  // namespace

void add_compare(CommandLine& line) {
  const Command command =
      line.command("compare", "Compare runs: hunting, voltage, chatter, falls, lateness",
                   "Example:  upright compare runs/20260101T120000Z-before runs/20260101T120500Z-after\n"
                   "The first run is the reference for the others. Only the last third of each run counts.\n"
                   "For the folder of an experiment in which controllers took turns, the command compares\n"
                   "the controllers round by round.");
  const auto flags = std::make_shared<CompareFlags>();
  command
      .option("runs", flags->runs,
              "Run directories, also of interrupted runs; or the folder of one experiment")
      .required();
  command.option("--out", flags->out, "HTML page to write (default: compare.html; with --json: none)");
  command.flag("--json", flags->as_json, "Print one JSON document");
  command.does([flags] { return compare(*flags); });
}

}  // namespace upright::cli
