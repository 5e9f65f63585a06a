// `upright design`: gains for a plant by linear-quadratic design.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "commands.hpp"
#include "upright/analysis/gain_design.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"

namespace upright::cli {

namespace {

using Json = nlohmann::ordered_json;

struct DesignOptions {
  std::string plant;
  std::vector<double> q{5000.0, 3000.0, 20.0, 20.0};
  double r = 1.0;
  double smoothing = 100.0;
  std::optional<double> delay_s;
  double rate_hz = 1000.0;
  double cutoff_hz = 50.0;
  double damping = 0.9;
  std::string out;
  bool force = false;
  bool as_json = false;
};

Json json_of(const EliminatedState& state) {
  return {{"state", state.state},
          {"eigenvalue", {state.eigenvalue.real(), state.eigenvalue.imag()}},
          {"explanation", state.explanation}};
}

Json json_of(const GainDesign& design, const std::optional<SampledDesign>& sampled) {
  Json poles = Json::array(), eliminated = Json::array();
  for (const auto& pole : design.closed_loop_poles) poles.push_back({pole.real(), pole.imag()});
  for (const EliminatedState& state : design.eliminated) eliminated.push_back(json_of(state));
  Json document{{"gains", design.gains},
                {"closed_loop_poles", poles},
                {"eliminated_states", eliminated},
                {"riccati_residual", design.residual},
                {"notes", design.notes}};
  if (sampled)
    document["sampled"] = {{"delay_periods", sampled->delay_periods},
                           {"prediction_s", sampled->prediction_s},
                           {"delay_line_residual", sampled->delay_line_residual},
                           {"delay_line_difference", sampled->delay_line_difference}};
  return document;
}

void print(const GainDesign& design, const std::optional<SampledDesign>& sampled) {
  constexpr std::array names = {"x [V/m]", "theta [V/rad]", "x_dot [V s/m]", "theta_dot [V s/rad]"};
  std::printf("gains\n");
  for (std::size_t i = 0; i < names.size(); ++i) std::printf("  %-20s %14.7f\n", names[i], design.gains[i]);
  std::printf("closed-loop poles [1/s]\n");
  for (const auto& pole : design.closed_loop_poles)
    std::printf("  %14.6f %+14.6fi\n", pole.real(), pole.imag());
  std::printf("Riccati residual %.1e (relative)\n", design.residual);
  if (sampled)
    std::printf(
        "delay line of %d periods and velocity filter as states: residual %.1e, its gains and these "
        "agree to %.1e\n",
        sampled->delay_periods, sampled->delay_line_residual, sampled->delay_line_difference);
  for (const EliminatedState& state : design.eliminated)
    std::printf("eliminated: %s\n", state.explanation.c_str());
  for (const std::string& note : design.notes) std::printf("note: %s\n", note.c_str());
  std::fflush(stdout);
}

/// The plant's path as the gain file, which may lie elsewhere, names it.
std::string path_from(const std::filesystem::path& file, const std::filesystem::path& plant) {
  std::error_code error;
  const auto folder = std::filesystem::absolute(file).parent_path();
  const auto relative = std::filesystem::relative(plant, folder, error);
  return error || relative.empty() ? std::filesystem::absolute(plant).string() : relative.string();
}

void write_gains(const DesignOptions& options, const GainDesign& design) {
  if (std::filesystem::exists(options.out) && !options.force)
    throw ConfigError("give another --out or add --force: " + options.out + " exists already");
  ControlConfig config;
  config.gains = {design.gains[0], design.gains[1], design.gains[2], design.gains[3]};
  config.delay_s = options.delay_s.value_or(0.0);
  config.sample_rate_hz = options.rate_hz;
  config.estimator.cutoff_hz = options.cutoff_hz;
  config.estimator.damping = options.damping;
  if (options.delay_s)
    config.compensation = {CompensationKind::predictor, path_from(options.out, options.plant)};
  write_gain_file(config, options.out, {"Designed by `upright design` on " + options.plant});
}

void design(const DesignOptions& options) {
  const Plant plant = read_plant_file(options.plant);
  DesignWeights weights;
  std::copy(options.q.begin(), options.q.end(), weights.q.begin());
  weights.r = options.r;
  std::optional<SampledDesign> sampled;
  GainDesign gains;
  if (options.delay_s) {
    EstimatorConfig estimator;
    estimator.cutoff_hz = options.cutoff_hz;
    estimator.damping = options.damping;
    sampled =
        design_sampled_gains(plant, weights, options.smoothing, options.rate_hz, *options.delay_s, estimator);
    gains = sampled->design;
  } else {
    gains = design_gains(plant, weights, options.smoothing);
  }
  if (!options.out.empty()) write_gains(options, gains);
  if (options.as_json)
    std::cout << json_of(gains, sampled).dump(2) << "\n";
  else
    print(gains, sampled);
}

}  // namespace

void add_design(CommandLine& line) {
  const Command command = line.command(
      "design", "Design gains for a plant (linear-quadratic)",
      "Examples:\n"
      "  upright design config/plants/exponential.yaml --q 5000,3000,20,20 --r 1 --out gains.yaml\n"
      "  upright design config/plants/viscous.yaml --delay 0.1 --rate 1000 --out compensated.yaml\n"
      "With --delay the gains feed back the state predicted to when the voltage acts (delay_compensation: "
      "predictor).");
  const auto options = std::make_shared<DesignOptions>();
  command.option("plant", options->plant, "Plant file").required();
  command.option("--q", options->q, "Weights on x, theta, x_dot, theta_dot")
      .list_of(4)
      .in(Range::not_negative());
  command.option("--r", options->r, "Weight on the voltage").in(Range::positive());
  command.option("--smoothing", options->smoothing, "sgn(v) is taken as tanh(smoothing v)")
      .in(Range::positive());
  command
      .option("--delay", options->delay_s, "Loop delay to design for [s]: sampled design, for the predictor")
      .in(Range::within(0.0, 10.0));
  command.option("--rate", options->rate_hz, "Sample rate [Hz]; with --delay, and for the gain file")
      .in(Range::within(lowest_sample_rate_hz, highest_sample_rate_hz));
  command.option("--cutoff", options->cutoff_hz, "Velocity filter in the gain file: cutoff [Hz]")
      .in(Range::positive());
  command.option("--damping", options->damping, "Velocity filter in the gain file: damping")
      .in(Range::positive());
  command.option("--out", options->out, "Write a gain file");
  command.flag("--force", options->force, "Replace the gain file if it exists");
  command.flag("--json", options->as_json, "One JSON document");
  command.does([options] {
    design(*options);
    return ExitCode::done;
  });
}

}  // namespace upright::cli
