// `upright check`: reads files as the other commands would, without hardware.
#include "check.hpp"

#include <algorithm>
#include <array>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "commands.hpp"
#include "commissioning/file_agreement.hpp"
#include "experiment/experiment_file.hpp"
#include "sweep/sweep.hpp"
#include "upright/base/error.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/measurement/measurement.hpp"
#include "upright/model/plant_file.hpp"

namespace upright::cli {

namespace {

/// A kind of file: its name, the key at its top level that tells it, and its reader.
struct FileKind {
  const char* name;
  const char* key;
  void (*read)(const std::filesystem::path& file);
};

void check_gains(const std::filesystem::path& file) {
  const ControlConfig config = read_gain_file(file);
  make_estimator_step(config.estimator, config.period_s());
  make_model_parts(config);
}

void check_rig(const std::filesystem::path& file) {
  const RigFile rig = read_rig_file(file);
  if (rig.simulated) read_plant_file(rig.simulated->plant);
}

void check_experiment(const std::filesystem::path& file) {
  const Experiment experiment = read_experiment_file(file);
  if (!experiment.plant.empty()) read_plant_file(experiment.plant);
  if (!experiment.gains.empty()) check_gains(experiment.gains);
}

constexpr const char* plant_kind = "plant";
constexpr const char* gain_kind = "gain";
constexpr const char* rig_kind = "rig";

constexpr std::array file_kinds = {
    FileKind{plant_kind, "plant", [](const std::filesystem::path& file) { read_plant_file(file); }},
    FileKind{gain_kind, "gains", check_gains},
    FileKind{rig_kind, "backend", check_rig},
    FileKind{"sweep", "sweep", [](const std::filesystem::path& file) { read_sweep_file(file); }},
    FileKind{"experiment", "experiment", check_experiment},
    FileKind{"dataset", "dataset",
             [](const std::filesystem::path& file) { read_measurement(file.string()); }},
};

struct CheckedFile {
  std::string file;
  std::string kind;
  std::string error;                  // empty: valid
  std::vector<std::string> warnings;  // valid, and hard to believe
};

const FileKind& kind_of_file(const YamlMap& document) {
  for (const FileKind& kind : file_kinds)
    if (document.has(kind.key)) return kind;
  std::vector<std::string> known;
  std::string list;
  for (const FileKind& kind : file_kinds) {
    known.emplace_back(kind.key);
    list += (list.empty() ? "" : ", ") + known.back();
  }
  for (const std::string& key : document.keys()) {
    const std::string near = nearest_name(key, known);
    if (!near.empty())
      document.fail(key, "is not a known key", "did you mean " + near + "? otherwise remove it");
  }
  throw ConfigError(document.file().string() +
                    ":1: the kind of file is unknown, because no top-level key identifies it: add one of " +
                    list);
}

CheckedFile check(const std::string& file) {
  CheckedFile finding{file, "", "", {}};
  try {
    const FileKind& kind = kind_of_file(YamlMap::from_file(file));
    finding.kind = kind.name;
    kind.read(file);
    if (finding.kind == plant_kind) finding.warnings = doubts_about(read_plant_file(file));
    if (finding.kind == gain_kind) finding.warnings = doubts_about(read_gain_file(file));
    if (finding.kind == rig_kind) finding.warnings = doubts_about(read_rig_file(file));
  } catch (const Error& error) {
    finding.error = error.what();
  }
  return finding;
}

/// The one file of this kind; empty: there is none, or it is not valid.
std::string only(const std::vector<CheckedFile>& findings, const char* kind) {
  for (const CheckedFile& finding : findings)
    if (finding.kind == kind && finding.error.empty()) return finding.file;
  return "";
}

/// Files are those of one run where there is no second of a kind; others have nothing to do with each other.
bool are_of_one_run(const std::vector<CheckedFile>& findings) {
  const auto several = [&findings](const char* kind) {
    return std::count_if(findings.begin(), findings.end(),
                         [kind](const CheckedFile& finding) { return finding.kind == kind; }) > 1;
  };
  return !several(plant_kind) && !several(gain_kind) && !several(rig_kind);
}

Agreement agreement_among(const std::vector<CheckedFile>& findings) {
  if (!are_of_one_run(findings)) return {};
  RunFiles files;
  if (const std::string file = only(findings, rig_kind); !file.empty()) files.rig = read_rig_file(file);
  if (const std::string file = only(findings, gain_kind); !file.empty()) files.control = read_gain_file(file);
  if (const std::string file = only(findings, plant_kind); !file.empty())
    files.plant = read_plant_file(file);
  else if (files.rig && is_simulated(*files.rig))
    files.plant = read_plant_file(files.rig->simulated->plant);
  return agreement_of(files);
}

using Json = nlohmann::ordered_json;

Json text_or_null(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

Json json_of(const CheckedFile& finding) {
  return {{"file", finding.file},
          {"valid", finding.error.empty()},
          {"kind", text_or_null(finding.kind)},
          {"error", text_or_null(finding.error)},
          {"warnings", finding.warnings}};
}

void print(const CheckedFile& finding, bool as_json) {
  if (!finding.error.empty()) std::cerr << "upright: " << finding.error << "\n";
  for (const std::string& warning : finding.warnings)
    std::cerr << "upright: warning: " << finding.file << ": " << warning << "\n";
  if (!as_json && finding.error.empty())
    std::cout << finding.file << ": a valid " << finding.kind << " file\n";
}

void print(const Agreement& agreement) {
  for (const std::string& error : agreement.errors)
    std::cerr << "upright: the files do not fit together: " << error << "\n";
  for (const std::string& warning : agreement.warnings) std::cerr << "upright: warning: " << warning << "\n";
}

bool check_all(const std::vector<std::string>& files, bool as_json) {
  std::vector<CheckedFile> findings;
  bool all_valid = true;
  Json list = Json::array();
  for (const std::string& file : files) {
    findings.push_back(check(file));
    all_valid = all_valid && findings.back().error.empty();
    print(findings.back(), as_json);
    list.push_back(json_of(findings.back()));
  }
  const Agreement agreement = agreement_among(findings);
  all_valid = all_valid && agreement.errors.empty();
  print(agreement);
  if (as_json) {
    const Json document{{"valid", all_valid},
                        {"files", list},
                        {"together", {{"errors", agreement.errors}, {"warnings", agreement.warnings}}}};
    // A file name need not be UTF-8.
    std::cout << document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
  }
  return all_valid;
}

}  // namespace

std::string fault_of_file(const std::string& file) {
  return check(file).error;
}

void add_check(CommandLine& line) {
  const Command command = line.command(
      "check", "Validate files without hardware",
      "Examples:\n"
      "  upright check config/plants/*.yaml config/gains/*.yaml config/rigs/*.yaml\n"
      "  upright check my-rig.yaml my-gains.yaml my-plant.yaml\n"
      "If there is at most one rig, one gain and one plant file, the command also checks that they fit\n"
      "together: sample rate and link, watchdogs and control period, gains and plant.");
  const auto files = std::make_shared<std::vector<std::string>>();
  const auto as_json = std::make_shared<bool>(false);
  command.option("files", *files, "Plant, gain, rig, sweep, experiment or dataset files").required();
  command.flag("--json", *as_json, "Print one JSON document");
  command.does([files, as_json] { return check_all(*files, *as_json) ? ExitCode::done : ExitCode::usage; });
}

}  // namespace upright::cli
