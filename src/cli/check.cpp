// `upright check`: reads files as the other commands would, without hardware.
#include <array>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "commands.hpp"
#include "upright/analysis/measurement.hpp"
#include "upright/analysis/sweep.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/runtime/experiment_file.hpp"

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
  if (config.compensation.kind == CompensationKind::predictor) read_plant_file(config.compensation.plant);
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

constexpr std::array file_kinds = {
    FileKind{"plant", "plant", [](const std::filesystem::path& file) { read_plant_file(file); }},
    FileKind{"gain", "gains", check_gains},
    FileKind{"rig", "backend", check_rig},
    FileKind{"sweep", "sweep", [](const std::filesystem::path& file) { read_sweep_file(file); }},
    FileKind{"experiment", "experiment", check_experiment},
    FileKind{"dataset", "dataset",
             [](const std::filesystem::path& file) { read_measurement(file.string()); }},
};

struct Finding {
  std::string file;
  std::string kind;
  std::string error;  // empty: valid
};

const FileKind& kind_of(const YamlMap& document) {
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
  throw ConfigError("give the file one of the top-level keys " + list + ": " + document.file().string() +
                    ":1: none of them is there");
}

Finding check(const std::string& file) {
  Finding finding{file, "", ""};
  try {
    const FileKind& kind = kind_of(YamlMap::from_file(file));
    finding.kind = kind.name;
    kind.read(file);
  } catch (const Error& error) {
    finding.error = error.what();
  }
  return finding;
}

using Json = nlohmann::ordered_json;

Json text_or_null(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

Json json_of(const Finding& finding) {
  return {{"file", finding.file},
          {"valid", finding.error.empty()},
          {"kind", text_or_null(finding.kind)},
          {"error", text_or_null(finding.error)}};
}

bool check_all(const std::vector<std::string>& files, bool as_json) {
  bool all_valid = true;
  Json list = Json::array();
  for (const std::string& file : files) {
    const Finding finding = check(file);
    all_valid = all_valid && finding.error.empty();
    if (!finding.error.empty()) std::cerr << "upright: " << finding.error << "\n";
    if (as_json)
      list.push_back(json_of(finding));
    else if (finding.error.empty())
      std::cout << file << ": a valid " << finding.kind << " file\n";
  }
  if (as_json) {
    const Json document{{"valid", all_valid}, {"files", list}};
    // A file name need not be UTF-8.
    std::cout << document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
  }
  return all_valid;
}

}  // namespace

void add_check(CommandLine& line) {
  const Command command =
      line.command("check", "Validate files without hardware",
                   "Example:  upright check config/plants/*.yaml config/gains/*.yaml config/rigs/*.yaml");
  const auto files = std::make_shared<std::vector<std::string>>();
  const auto as_json = std::make_shared<bool>(false);
  command.option("files", *files, "The files to read").required();
  command.flag("--json", *as_json, "One JSON document");
  command.does([files, as_json] { return check_all(*files, *as_json) ? ExitCode::done : ExitCode::usage; });
}

}  // namespace upright::cli
