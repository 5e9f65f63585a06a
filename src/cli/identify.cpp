// `upright identify`: friction and motor constants from measured runs.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "commands.hpp"
#include "options.hpp"
#include "upright/analysis/identification.hpp"
#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/report/identification_report.hpp"
#include "upright/runtime/experiment.hpp"

namespace upright::cli {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct IdentifyFlags {
  std::string plant, out;
  std::vector<std::string> data;
  bool as_json = false;
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
      "name a plant file with --plant: its masses and the motor's force per volt are needed, its friction is "
      "not");
}

/// Experiment folders stand for the runs in them.
std::vector<std::string> runs_in(const std::vector<std::string>& data) {
  std::vector<std::string> runs;
  for (const std::string& item : data) {
    std::error_code problem;
    if (!fs::exists(fs::path(item) / "trials.csv", problem)) {
      runs.push_back(item);
      continue;
    }
    // In the order of the trials: names hold the second of the start only, so that sorting them would let the
    // speed of the machine decide the order, and with it which samples are thinned out.
    for (const TrialResult& trial : read_trials(item))
      if (const fs::path run = fs::path(item) / trial.run_directory; fs::exists(run / "samples.csv", problem))
        runs.push_back(run.string());
  }
  return runs;
}

Json json_of(const Identification& id) {
  Json parameters = Json::array();
  for (const IdentifiedParameter& p : id.parameters)
    parameters.push_back({{"name", p.name},
                          {"unit", p.unit},
                          {"value", p.value},
                          {"ci95", {p.low, p.high}},
                          {"from", p.source},
                          {"goodness", p.goodness}});
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
  return {{"parameters", parameters}, {"force_balance", balance}, {"breakaways", breakaways},
          {"steady_points", steady},  {"residual_rms", id.rms},   {"notes", id.notes}};
}

void print(const Identification& id) {
  for (const IdentifiedParameter& p : id.parameters)
    std::printf("  %-44s %11.5g %-10s (95%%: %.5g to %.5g)  %s\n", p.name.c_str(), p.value, p.unit.c_str(),
                p.low, p.high, p.source.c_str());
  if (id.balance)
    std::printf(
        "Balance of forces alone: mass %.5g kg, damping %.5g N/(m/s), Coulomb %.4g N, constant %.4g N; "
        "%.2g %% of the force is left.\n",
        id.balance->mass_kg, id.balance->damping_n_per_mps, id.balance->coulomb_n, id.balance->constant_n,
        100.0 * id.balance->relative_error);
  std::printf("Read directly: %zu breakaways, %zu steady speeds. Innovations %.2f of the noise.\n",
              id.breakaways.size(), id.steady_points.size(), id.rms);
  for (const std::string& note : id.notes) std::printf("Note: %s.\n", note.c_str());
}

void write_results(const Identification& id, const std::vector<Measurement>& runs,
                   const IdentifyFlags& flags) {
  std::error_code problem;
  fs::create_directories(flags.out, problem);
  if (problem)
    throw ConfigError("choose another folder with --out: cannot make " + flags.out + " (" +
                      problem.message() + ")");
  std::vector<std::string> comments = {"Identified by upright " UPRIGHT_VERSION "."};
  for (const std::string& data : flags.data) comments.push_back("data: " + data);
  write_plant_file(id.plant, fs::path(flags.out) / "plant.yaml", comments);
  const fs::path file = fs::path(flags.out) / "identification.json";
  std::ofstream json(file);
  json << json_of(id).dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
  json.close();
  if (!json)
    throw ConfigError("free some space or choose another folder with --out: cannot write " + file.string());
  write_identification_report(id, runs, fs::path(flags.out) / "report.html");
}

void run_identify(const IdentifyFlags& flags) {
  const Plant base = base_of(flags);
  std::vector<Measurement> runs;
  for (const std::string& data : runs_in(flags.data)) runs.push_back(read_measurement(data));
  if (!flags.out.empty() && fs::exists(fs::path(flags.out) / "identification.json"))
    throw ConfigError("choose another folder with --out: " + flags.out + " holds an identification already");
  IdentificationOptions options;
  const bool watched = isatty(STDERR_FILENO) != 0;
  if (watched)
    options.progress = [](double done, const std::string& what) {
      std::fprintf(stderr, "\r%3.0f %%  %-40.40s", 100.0 * done, what.c_str());
    };
  const Identification id = identify(base, runs, options);
  if (watched) std::fprintf(stderr, "\r%60s\r", "");
  if (!flags.out.empty()) write_results(id, runs, flags);
  if (flags.as_json) {
    std::cout << json_of(id).dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    print(id);
    if (!flags.out.empty()) std::printf("Written: %s\n", flags.out.c_str());
    std::fflush(stdout);
  }
  finish_output();
}

}  // namespace

void add_identify(CommandLine& line) {
  const Command command = line.command(
      "identify", "Friction and motor constants from measured runs",
      "Example:  upright identify --data runs/20260101T120000Z-friction --plant config/plants/viscous.yaml "
      "--out identified\n"
      "Of the plant file the masses, the length and the motor are used; its friction is found anew.");
  const auto flags = std::make_shared<IdentifyFlags>();
  command.option("--data", flags->data, "Experiment folders, run directories, CSV or dataset files")
      .required();
  command.option("--plant", flags->plant, "Plant file with masses and motor (a simulated run's own)");
  command.option("--out", flags->out, "Folder for identification.json, plant.yaml and report.html");
  command.flag("--json", flags->as_json, "One JSON document on stdout");
  command.does([flags] {
    run_identify(*flags);
    return ExitCode::done;
  });
}

}  // namespace upright::cli
