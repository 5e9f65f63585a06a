// `upright simulate`: what a plant file does under the voltages of a record, against what was measured.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/number_text.hpp"
#include "commands.hpp"
#include "estimation/simulation.hpp"
#include "experiment_data.hpp"
#include "json_number.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "report/simulation_report.hpp"
#include "result_folder.hpp"
#include "signals.hpp"
#include "upright/base/error.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/record/run_reader.hpp"

namespace upright::cli {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct SimulateFlags {
  std::string plant, gains, out;
  std::vector<std::string> data;
  std::string horizon = "whole";
  std::optional<double> from_s;
  unsigned initial_samples = usual_initial_samples;
  bool as_json = false;
};

/// One run of the data: where it is, what was measured, what the plant does.
struct SimulatedFile {
  fs::path file;
  const Measurement& run;
  const RunSimulation& simulation;
};

std::optional<double> horizon_of(const std::string& text) {
  double seconds = 0.0;
  const auto end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, seconds);
  if (read.ec != std::errc{} || read.ptr != end || !(seconds > 0.0) || !std::isfinite(seconds))
    return std::nullopt;
  return seconds;
}

std::string fault_of_horizon(const std::string& text) {
  if (text == "whole" || horizon_of(text)) return "";
  return "must be a number of seconds above 0, or the word whole";
}

/// The controller that a run would have had. The amplifier's limit is that of the run's own rig.
SimulatedController controller_for(const fs::path& data, const ControlConfig& control,
                                   std::vector<std::string>& notes) {
  constexpr double above_any_command_v = 1e6;
  SimulatedController controller{control, above_any_command_v, {}};
  if (control.has_state_estimator() || control.compensation.kind != CompensationKind::none)
    controller.make_parts = [control] { return make_model_parts(control); };
  std::error_code problem;
  if (!fs::exists(data / "run.yaml", problem)) {
    notes.push_back(data.string() +
                    " is no run directory, so no limit of the amplifier is known: the voltage " +
                    "is limited only by voltage_saturation of the plant file");
    return controller;
  }
  const RunRecord record = read_run_without_samples(data);
  if (record.document.has("experiment"))
    throw ConfigError(
        data.string() +
        " is a run of an experiment, whose script commands set-points and voltages: simulate it "
        "without --closed-loop");
  controller.amplifier_limit_v = record.rig.amplifier.limit_v;
  return controller;
}

/// A pendulum that was held upright, and falls without its controller.
std::optional<std::string> fall_note(const SimulatedFile& one) {
  if (!one.run.has_theta() || one.simulation.theta_rad.empty()) return std::nullopt;
  constexpr double upright_rad = 0.5, fallen_rad = 1.0;
  for (const Segment& piece : one.simulation.pieces)
    for (std::size_t k = piece.first; k <= piece.last; ++k) {
      const double measured = std::remainder(one.run.theta_rad[k], 2.0 * M_PI);
      if (std::abs(measured) > upright_rad) break;
      if (std::abs(one.simulation.theta_rad[k] - one.run.theta_rad[k]) > fallen_rad)
        return one.file.string() + ": the pendulum is upright at " + brief_text(one.run.time_s[k]) +
               " s, but has fallen in the simulation, since nothing balances it: simulate short pieces with "
               "--horizon 0.5, or the controller with --closed-loop GAINS";
    }
  return std::nullopt;
}

std::vector<std::string> notes_of(const SimulatedFile& one) {
  std::vector<std::string> notes = one.run.notes;
  if (const auto fall = fall_note(one)) notes.push_back(*fall);
  if (one.simulation.samples < one.run.size())
    notes.push_back(one.file.string() + ": " + std::to_string(one.run.size() - one.simulation.samples) +
                    " of " + std::to_string(one.run.size()) +
                    " samples are in no piece: before --from, after a gap, or in a rest that is too short");
  return notes;
}

Json json_of(const SimulatedFile& one) {
  const ChannelError& cart = one.simulation.cart_error_m;
  const ChannelError& theta = one.simulation.theta_error_rad;
  return {{"file", one.file.string()},
          {"samples", one.simulation.samples},
          {"pieces", one.simulation.pieces.size()},
          {"cart_rmse_m", finite_or_null(cart.rmse)},
          {"cart_percent", finite_or_null(cart.percent)},
          {"cart_largest_m", finite_or_null(cart.largest)},
          {"theta_rmse_rad", finite_or_null(theta.rmse)},
          {"theta_percent", finite_or_null(theta.percent)},
          {"theta_largest_rad", finite_or_null(theta.largest)},
          {"notes", notes_of(one)}};
}

Json json_of(const std::vector<SimulatedFile>& files, const std::vector<std::string>& notes,
             const SimulateFlags& flags) {
  Json runs = Json::array();
  for (const SimulatedFile& one : files) runs.push_back(json_of(one));
  const auto horizon = horizon_of(flags.horizon);
  return {{"plant", flags.plant},
          {"gains", flags.gains.empty() ? Json(nullptr) : Json(flags.gains)},
          {"horizon_s", horizon ? Json(*horizon) : Json(nullptr)},
          {"initial_samples", flags.initial_samples},
          {"percent_of", "standard deviation of the measurement"},
          {"runs", runs},
          {"notes", notes}};
}

void print(const char* channel, const char* unit, const ChannelError& error) {
  if (std::isnan(error.rmse)) return;
  std::printf("  %-9s RMS error %s %s (%s %% of the motion), largest %s %s at %s s\n", channel,
              number_text(1e3 * error.rmse).c_str(), unit, number_text(error.percent, 3).c_str(),
              number_text(1e3 * error.largest).c_str(), unit, number_text(error.largest_at_s).c_str());
}

void print(const std::vector<SimulatedFile>& files, const std::vector<std::string>& notes,
           const SimulateFlags& flags) {
  for (const SimulatedFile& one : files) {
    const std::size_t pieces = one.simulation.pieces.size();
    std::printf("%s: %zu samples in %zu piece%s\n", one.file.c_str(), one.simulation.samples, pieces,
                pieces == 1 ? "" : "s");
    print("cart", "mm", one.simulation.cart_error_m);
    print("pendulum", "mrad", one.simulation.theta_error_rad);
  }
  for (const std::string& note : notes) std::printf("Note: %s.\n", note.c_str());
  for (const SimulatedFile& one : files)
    for (const std::string& note : notes_of(one)) std::printf("Note: %s.\n", note.c_str());
  if (!flags.out.empty()) std::printf("Written: %s\n", (fs::path(flags.out) / "report.html").c_str());
  std::fflush(stdout);
}

/// A cell is empty where there is nothing measured.
void write_curves(const std::vector<SimulatedFile>& files, std::ostream& out) {
  out << "file,piece,time_s,voltage_v,simulated_voltage_v,cart_m,simulated_cart_m,theta_rad,simulated_theta_"
         "rad\n";
  for (const SimulatedFile& one : files) {
    std::string name = one.file.string();
    std::replace(name.begin(), name.end(), ',', '_');
    for (std::size_t p = 0; p < one.simulation.pieces.size(); ++p)
      for (std::size_t k = one.simulation.pieces[p].first; k <= one.simulation.pieces[p].last; ++k) {
        out << name << ',' << p + 1;
        for (const auto* values :
             {&one.run.time_s, &one.run.voltage_v, &one.simulation.voltage_v, &one.run.cart_m,
              &one.simulation.cart_m, &one.run.theta_rad, &one.simulation.theta_rad}) {
          out << ',';
          if (!values->empty()) out << exact_text((*values)[k]);
        }
        out << '\n';
      }
  }
}

ExitCode run_simulate(const SimulateFlags& flags) {
  end_on_signal();
  Progress progress("reading the data");
  const Plant plant = read_plant_file(flags.plant);
  const NamedRuns named = runs_named(flags.data);
  std::vector<std::string> notes = named.left_out;
  std::vector<Measurement> runs;
  for (const fs::path& data : named.runs) runs.push_back(read_measurement(data));
  std::vector<SimulatedController> controllers;
  if (!flags.gains.empty()) {
    const ControlConfig control = read_gain_file(flags.gains);
    for (const fs::path& data : named.runs) controllers.push_back(controller_for(data, control, notes));
  }
  const fs::path folder = flags.out;
  if (!flags.out.empty() && fs::exists(folder / "simulation.json"))
    throw ConfigError(flags.out + " already holds a simulation: choose another folder with --out");
  progress.begin("simulate");
  const SimulationOptions options{flags.from_s, horizon_of(flags.horizon), flags.initial_samples};
  const std::vector<RunSimulation> simulations = simulate_runs(plant, runs, options, controllers);
  std::vector<SimulatedFile> files;
  for (std::size_t r = 0; r < runs.size(); ++r) files.push_back({named.runs[r], runs[r], simulations[r]});
  const std::string json =
      json_of(files, notes, flags).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  if (!flags.out.empty()) {
    progress.begin("writing the results");
    create_result_folder(folder);
    write_result(folder / "simulated.csv", [&](std::ostream& out) { write_curves(files, out); });
    write_result(folder / "simulation.json", [&](std::ostream& out) { out << json; });
    write_simulation_report({flags.plant, flags.gains}, runs, simulations, folder / "report.html");
  }
  progress.end();
  if (flags.as_json) {
    std::cout << json;
  } else {
    print(files, notes, flags);
  }
  finish_output();
  return ExitCode::done;
}

}  // namespace

void add_simulate(CommandLine& line) {
  const Command command = line.command(
      "simulate", "Simulate a plant file under the voltages of measured runs, and compare",
      "Example:  upright simulate config/plants/viscous.yaml --data runs/20260101T120000Z-run --out "
      "simulated\n"
      "The whole record is simulated in open loop. Its initial position and velocity are fitted to the\n"
      "first 20 samples. The error is that of all samples. A gap in the record starts a new piece.");
  const auto flags = std::make_shared<SimulateFlags>();
  command.option("plant", flags->plant, "Plant file").required();
  command
      .option("--data", flags->data,
              "Measured runs: experiment folders, run directories, CSV or dataset files")
      .required();
  command.option("--from", flags->from_s, "Begin at this time of the record [s] (default: its first sample)");
  command
      .option("--horizon", flags->horizon,
              "Length of a piece [s]; each piece starts again from its own first samples (default: whole)")
      .without(fault_of_horizon);
  command
      .option("--initial-samples", flags->initial_samples,
              "Number of samples to which the initial state is fitted (default: 20)")
      .from_to(2u, 1000000u);
  command.option(
      "--closed-loop", flags->gains,
      "Gain file: simulate this controller about cart position 0 instead of the recorded voltages");
  command.option("--out", flags->out, "Folder for simulated.csv, simulation.json and report.html");
  command.flag("--json", flags->as_json, "Print one JSON document");
  command.does([flags] { return run_simulate(*flags); });
}

}  // namespace upright::cli
