// `upright identify`: friction and motor constants from measured runs.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "commands.hpp"
#include "diagnosis/plain_words.hpp"
#include "experiment_data.hpp"
#include "identification/identification.hpp"
#include "measurement/data_check.hpp"
#include "measurement/long_records.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "report/identification_report.hpp"
#include "result_folder.hpp"
#include "signals.hpp"
#include "upright/base/error.hpp"
#include "upright/model/plant_file.hpp"

namespace upright::cli {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct IdentifyFlags {
  std::string plant, out;
  std::vector<std::string> data;
  bool as_json = false;
  bool trust_data = false;
};

/// Masses and motor: the plant file's, or those a simulated rig wrote into its run.
Plant base_of(const IdentifyFlags& flags) {
  if (!flags.plant.empty()) return read_plant_file(flags.plant);
  for (const std::string& data : flags.data) {
    const fs::path file = fs::path(data) / "run.yaml";
    std::error_code problem;
    if (!fs::exists(file, problem)) continue;
    const YamlMap document = YamlMap::from_file(file);
    if (document.has("plant")) return read_plant(document);
  }
  throw ConfigError(
      "the masses and the motor constants are unknown: name a plant file with --plant (its friction is not "
      "used)");
}

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

/// Asks what else moves the rig.
std::string next_command(const IdentifyFlags& flags) {
  std::string command =
      "upright diagnose --model " + (flags.plant.empty() ? "PLANT" : flags.plant) + " --data";
  for (const std::string& data : flags.data) command += " " + data;
  return command;
}

Json verdict_json(const Identification& id, const IdentifyFlags& flags) {
  Json document = {{"verdict", std::string(name_of(id.verdict))},
                   {"gap",
                    {{"measure", "held-out simulation error / noise floor"},
                     {"before", number(id.gap_before)},
                     {"after", number(id.gap_after)}}},
                   {"trustworthy", id.is_trustworthy()},
                   {"residual", id.residual}};
  if (id.interrupted) document["interrupted"] = true;
  if (id.verdict == Verdict::unexplained && !id.interrupted) document["next_command"] = next_command(flags);
  return document;
}

Json json_of(const Identification& id, const IdentifyFlags& flags) {
  Json parameters = Json::array();
  for (const IdentifiedParameter& p : id.parameters)
    parameters.push_back({{"name", p.name},
                          {"unit", p.unit},
                          {"value", number(p.value)},
                          {"ci95", {number(p.low), number(p.high)}},
                          {"from", p.source},
                          {"goodness", p.goodness},
                          {"trustworthy", id.is_trustworthy()}});
  Json balance = nullptr;
  if (id.balance)
    balance = {{"mass_kg", id.balance->mass_kg},
               {"damping_n_per_mps", id.balance->damping_n_per_mps},
               {"coulomb_n", id.balance->coulomb_n},
               {"constant_n", id.balance->constant_n},
               {"relative_force_error", id.balance->relative_error},
               {"rows", id.balance->rows}};
  Json breakaways = Json::array();
  for (const Breakaway& b : id.breakaways)
    breakaways.push_back({{"run", b.run}, {"time_s", b.time_s}, {"force_n", b.force_n}});
  Json steady = Json::array();
  for (const SteadyPoint& s : id.steady_points)
    steady.push_back({{"run", s.run}, {"cart_mps", s.cart_mps}, {"friction_n", s.friction_n}});
  Json document = verdict_json(id, flags);
  document.update(Json{{"parameters", parameters},
                       {"force_balance", balance},
                       {"breakaways", breakaways},
                       {"steady_points", steady},
                       {"residual_rms", number(id.rms)},
                       {"notes", id.notes}});
  return document;
}

void print_verdict(const Identification& id, const IdentifyFlags& flags) {
  if (id.interrupted) {
    std::printf(
        "INTERRUPTED: the fit is not finished. The values below are the best so far. They were not "
        "tested.\n");
    return;
  }
  switch (id.verdict) {
    case Verdict::explained:
      std::printf("Explained: the identified values explain the data, including held-out runs.\n");
      break;
    case Verdict::not_excited:
      std::printf("NOT EXCITED: the data do not determine the values (%s). Do not use the values below.\n",
                  in_plain_words(id.residual).c_str());
      break;
    default:
      std::printf(
          "UNEXPLAINED: the rig has an effect that identify does not model, so the values below are biased. "
          "Do not use them.\n"
          "To find the missing effect:  %s\n",
          next_command(flags).c_str());
      break;
  }
  if (std::isfinite(id.gap_after))
    std::printf(
        "Gap (open-loop error on held-out data / noise floor): %.2f with the plant file, %.2f identified.\n",
        id.gap_before, id.gap_after);
  if (id.verdict != Verdict::not_excited)
    std::printf("Residual tests: %s.\n", in_plain_words(id.residual).c_str());
}

void print(const Identification& id, const IdentifyFlags& flags) {
  print_verdict(id, flags);
  if (!id.is_trustworthy() && !id.parameters.empty()) std::printf("Not usable:\n");
  for (const IdentifiedParameter& p : id.parameters)
    std::printf("  %-44s %11.5g %-10s (95%%: %.5g to %.5g)  %s\n", p.name.c_str(), p.value, p.unit.c_str(),
                p.low, p.high, p.source.c_str());
  if (id.balance)
    std::printf(
        "Force balance only: mass %.5g kg, damping %.5g N/(m/s), Coulomb %.4g N, constant %.4g N; "
        "residual %.2g %% of the force.\n",
        id.balance->mass_kg, id.balance->damping_n_per_mps, id.balance->coulomb_n, id.balance->constant_n,
        100.0 * id.balance->relative_error);
  std::printf("Measured directly: %zu breakaways, %zu steady speeds. RMS innovation: %.2f times the noise.\n",
              id.breakaways.size(), id.steady_points.size(), id.rms);
  for (const std::string& note : id.notes) std::printf("Note: %s.\n", in_plain_words(note).c_str());
}

void write_results(const Identification& id, const std::vector<Measurement>& runs,
                   const IdentifyFlags& flags) {
  create_result_folder(flags.out);
  // A plant file says that these are the rig's numbers.
  if (id.is_trustworthy()) {
    std::vector<std::string> comments = {"Identified by upright " UPRIGHT_VERSION "."};
    for (const std::string& data : flags.data) comments.push_back("data: " + data);
    write_plant_file(id.plant, fs::path(flags.out) / "plant.yaml", comments);
  }
  write_result(fs::path(flags.out) / "identification.json", [&](std::ostream& out) {
    out << json_of(id, flags).dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
  });
  // Drawing takes longer than whoever interrupts wants to wait.
  if (!id.interrupted) write_identification_report(id, runs, fs::path(flags.out) / "report.html");
}

ExitCode run_identify(const IdentifyFlags& flags) {
  end_on_signal();
  Progress progress("reading the data");
  const Plant base = base_of(flags);
  const NamedRuns named = runs_named(flags.data);
  std::vector<Measurement> runs;
  for (const fs::path& data : named.runs) runs.push_back(read_measurement(data));
  if (!flags.trust_data) refuse_mistakes(runs, base);
  runs = within_samples(std::move(runs), max_identified_samples);
  if (!flags.out.empty() && fs::exists(fs::path(flags.out) / "identification.json"))
    throw ConfigError(flags.out + " already holds an identification: choose another folder with --out");
  IdentificationOptions options;
  options.signal = &answer_on_signal();
  progress.begin("identify");
  options.progress = progress.callback();
  Identification id = identify(base, runs, options);
  id.notes.insert(id.notes.begin(), named.left_out.begin(), named.left_out.end());
  for (const Measurement& run : runs) id.notes.insert(id.notes.end(), run.notes.begin(), run.notes.end());
  progress.begin("writing the results");
  if (!flags.out.empty()) write_results(id, runs, flags);
  progress.end();
  if (flags.as_json) {
    std::cout << json_of(id, flags).dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    print(id, flags);
    if (!flags.out.empty()) std::printf("Written: %s\n", flags.out.c_str());
    std::fflush(stdout);
  }
  finish_output();
  return id.interrupted ? ExitCode::stopped : ExitCode::done;
}

}  // namespace

void add_identify(CommandLine& line) {
  const Command command = line.command(
      "identify", "Identify friction and motor constants from measured runs",
      "Example:  upright identify --data runs/20260101T120000Z-friction --plant config/plants/viscous.yaml "
      "--out identified\n"
      "Masses, length and motor come from the plant file. Its friction is not used but identified.\n"
      "The verdict says whether the values explain the data. It does not change the exit code.\n"
      "Ctrl-C stops the fit and gives the best values so far, with exit code 3. A second Ctrl-C ends the\n"
      "program at once.");
  const auto flags = std::make_shared<IdentifyFlags>();
  command
      .option("--data", flags->data,
              "Measured runs: experiment folders, run directories, CSV or dataset files")
      .required();
  command.option("--plant", flags->plant,
                 "Plant file with masses and motor (default: the plant of a simulated run)");
  command.option("--out", flags->out,
                 "Folder for identification.json, report.html and, if the data are explained, plant.yaml");
  command.flag("--trust-data", flags->trust_data,
               "Continue even if signs, zeros or units of the data contradict the plant file");
  command.flag("--json", flags->as_json, "Print one JSON document");
  command.does([flags] { return run_identify(*flags); });
}

}  // namespace upright::cli
