// `upright design`: gains for a plant by linear-quadratic design.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "commands.hpp"
#include "design/delay_margin.hpp"
#include "design/estimator_design.hpp"
#include "design/gain_design.hpp"
#include "design/widened_margin.hpp"
#include "progress.hpp"
#include "result_folder.hpp"
#include "upright/base/error.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/model/plant_file.hpp"

namespace upright::cli {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* no_estimator = "none";
constexpr const char* extended_estimator = "extended_kalman";

struct DesignOptions {
  std::string plant;
  std::vector<double> q;
  std::optional<double> r;
  std::string estimator = no_estimator;
  double smoothing = 100.0;
  std::optional<double> delay_s;
  std::optional<double> for_delay_s;
  std::optional<double> cost_loss;
  std::optional<double> uncertainty;
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
        "check with the delay line of %d periods and the velocity filter as states: residual %.1e, gains "
        "differ by %.1e\n",
        sampled->delay_periods, sampled->delay_line_residual, sampled->delay_line_difference);
  for (const EliminatedState& state : design.eliminated)
    std::printf("eliminated state: %s\n", state.explanation.c_str());
  for (const std::string& note : design.notes) std::printf("note: %s\n", note.c_str());
  std::fflush(stdout);
}

DesignWeights weights_of(const DesignOptions& options, DesignWeights weights) {
  std::copy(options.q.begin(), options.q.end(), weights.q.begin());
  weights.r = options.r.value_or(weights.r);
  return weights;
}

/// What the file cannot say in keys: the plant, and the weights that the gains follow from.
std::vector<std::string> comments_for(const DesignOptions& options, const DesignWeights& weights) {
  std::string text = "--q ";
  for (std::size_t i = 0; i < weights.q.size(); ++i)
    text += std::string(i > 0 ? "," : "") + exact_text(weights.q[i]);
  text += " --r " + exact_text(weights.r) + " --smoothing " + exact_text(options.smoothing);
  return {"Designed by `upright design` on " + options.plant,
          "Weights on x, theta, x_dot, theta_dot and the voltage: " + text};
}

/// A gain file with the velocity filter.
ControlConfig filtered(const DesignOptions& options, const GainDesign& design) {
  ControlConfig config;
  config.gains = {design.gains[0], design.gains[1], design.gains[2], design.gains[3]};
  config.delay_s = options.for_delay_s ? *options.for_delay_s : options.delay_s.value_or(0.0);
  config.sample_rate_hz = options.rate_hz;
  config.estimator.cutoff_hz = options.cutoff_hz;
  config.estimator.damping = options.damping;
  return config;
}

void write_gains(const DesignOptions& options, const DesignWeights& weights, ControlConfig config) {
  refuse_replacing(options.out, options.force);
  if (options.delay_s)
    config.compensation = {CompensationKind::predictor, path_from(options.out, options.plant)};
  write_gain_file(config, options.out, comments_for(options, weights));
}

Json json_of(const WidenedMargin& widened) {
  return {{"cost_loss", widened.cost_loss},
          {"lqr_critical_delay_s", widened.lqr_critical_s},
          {"critical_delay_s", widened.critical_s}};
}

void print(const WidenedMargin& widened) {
  std::printf(
      "critical delay %.3g ms, sampled, while the cart slides (LQR gains: %.3g ms), for %.3g percent more "
      "than the smallest cost\n",
      1e3 * widened.critical_s, 1e3 * widened.lqr_critical_s, 1e2 * widened.cost_loss);
}

Json json_of(const EstimatorDesign& design) {
  Json document = json_of(design.gains.design, design.gains);
  if (design.widened) document["margin"] = json_of(*design.widened);
  document["estimator"] = {
      {"cart_force_noise_n2_per_s", *design.config.state_estimator.cart_force_noise_n2_per_s},
      {"bears_delay_s", std::isfinite(design.delay_margin_s) ? Json(design.delay_margin_s) : Json(nullptr)},
      {"bears_unmodelled_delay_s", std::isfinite(design.unmodelled_delay_margin_s)
                                       ? Json(design.unmodelled_delay_margin_s)
                                       : Json(nullptr)}};
  if (const auto& trials = design.trials)
    document["trials"] = {{"runs", trials->runs},
                          {"fell", trials->fell},
                          {"hunting_m", trials->hunting_m},
                          {"largest_hunting_m", trials->largest_hunting_m},
                          {"most_sensitive_to", trials->most_sensitive_to}};
  return document;
}

void print(const ParameterTrials& trials, double uncertainty) {
  std::printf("%d simulated runs with parameters %.3g percent wrong, alone and together: no fall\n",
              trials.runs, 100.0 * uncertainty);
  std::printf(
      "  hunting of the cart: %.1f mm with the plant file as it is, %.1f mm in the worst run; most sensitive "
      "to %s\n",
      1e3 * trials.hunting_m, 1e3 * trials.largest_hunting_m, trials.most_sensitive_to.c_str());
}

void design_estimator(const DesignOptions& options, const Plant& plant, Progress& progress) {
  EstimatorRequest request;
  if (options.estimator == extended_estimator) request.kind = StateEstimatorKind::extended_kalman;
  request.uncertainty = options.uncertainty.value_or(parameter_uncertainty);
  request.plant_file = std::filesystem::absolute(options.plant);
  request.weights = weights_of(options, quiet_weights);
  request.smoothing = options.smoothing;
  request.rate_hz = options.rate_hz;
  request.delay_s = options.delay_s;
  request.for_delay_s = options.for_delay_s;
  request.cost_loss = options.cost_loss.value_or(accepted_cost_loss);
  const EstimatorDesign design = design_with_estimator(plant, request);
  progress.end();
  char margins[160];
  std::snprintf(
      margins, sizeof margins,
      "while the cart slides it bears %.3g ms more of delay, and %.3g ms of an actuator slower than "
      "the plant file says",
      1e3 * design.delay_margin_s, 1e3 * design.unmodelled_delay_margin_s);
  if (!options.out.empty()) {
    refuse_replacing(options.out, options.force);
    ControlConfig config = design.config;
    config.state_estimator.plant = path_from(options.out, options.plant);
    if (options.delay_s) config.compensation.plant = config.state_estimator.plant;
    write_gain_file(
        config, options.out,
        {"Designed by `upright design --estimator " + options.estimator + "` on " + options.plant + ":",
         margins});
  }
  if (options.as_json) {
    std::cout << json_of(design).dump(2) << "\n";
    return;
  }
  print(design.gains.design, design.gains);
  if (design.widened) print(*design.widened);
  std::printf("estimator: force noise %.4g N^2/s; %s\n",
              *design.config.state_estimator.cart_force_noise_n2_per_s, margins);
  if (design.trials) print(*design.trials, request.uncertainty);
  std::fflush(stdout);
}

/// Gains for the velocity filter.
struct FilteredDesign {
  GainDesign gains;
  std::optional<SampledDesign> sampled;
  std::optional<WidenedMargin> widened;
  ControlConfig config;
};

FilteredDesign design_for_filter(const DesignOptions& options, const Plant& plant,
                                 const DesignWeights& weights) {
  FilteredDesign design;
  if (options.for_delay_s) {
    const Plant sliding = large_motion_plant(plant);
    design.gains = design_sampled_gains(sliding, weights, options.smoothing, options.rate_hz, 0.0).design;
    design.config = filtered(options, design.gains);
    design.widened = widen_margin(
        sliding, {weights, options.smoothing, options.cost_loss.value_or(accepted_cost_loss)}, design.config);
    adopt(*design.widened, design.gains);
    return design;
  }
  if (options.delay_s) {
    EstimatorConfig estimator;
    estimator.cutoff_hz = options.cutoff_hz;
    estimator.damping = options.damping;
    design.sampled =
        design_sampled_gains(plant, weights, options.smoothing, options.rate_hz, *options.delay_s, estimator);
  }
  design.gains = design.sampled ? design.sampled->design : design_gains(plant, weights, options.smoothing);
  design.config = filtered(options, design.gains);
  return design;
}

void refuse_unused(const DesignOptions& options) {
  if (options.uncertainty && options.estimator == no_estimator)
    throw ConfigError("--uncertainty needs an estimator: add --estimator, or remove --uncertainty");
  if (options.for_delay_s && options.delay_s)
    throw ConfigError("--delay designs a predictor and --for-delay does without one: give one of the two");
  if (options.cost_loss && !options.for_delay_s)
    throw ConfigError("--cost-loss is for --for-delay: add --for-delay, or remove --cost-loss");
}

void design(const DesignOptions& options) {
  refuse_unused(options);
  Progress progress("design");
  const Plant plant = read_plant_file(options.plant);
  if (options.estimator != no_estimator) {
    design_estimator(options, plant, progress);
    return;
  }
  const DesignWeights weights = weights_of(options, {});
  const FilteredDesign found = design_for_filter(options, plant, weights);
  if (!options.out.empty()) write_gains(options, weights, found.config);
  progress.end();
  if (options.as_json) {
    Json document = json_of(found.gains, found.sampled);
    if (found.widened) document["margin"] = json_of(*found.widened);
    document["written_to"] = options.out.empty() ? Json(nullptr) : Json(options.out);
    std::cout << document.dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
    return;
  }
  print(found.gains, found.sampled);
  if (found.widened) print(*found.widened);
  if (!options.out.empty()) std::printf("written to %s\n", options.out.c_str());
  std::fflush(stdout);
}

/// The delay and the rate of the loop, and the velocity filter.
void add_loop_options(const Command& command, DesignOptions& options) {
  command
      .option("--delay", options.delay_s,
              "Loop delay to compensate with a predictor [s]; the design is then discrete-time")
      .in(Range::within(0.0, 10.0));
  command
      .option("--for-delay", options.for_delay_s,
              "Loop delay to tolerate without a predictor [s]: gains, and force noise of the estimator, with "
              "the largest delay margin within --cost-loss")
      .in(Range::within(0.0, 10.0));
  command
      .option("--cost-loss", options.cost_loss,
              "With --for-delay: relative excess over the smallest LQR cost that the gains may have "
              "(default: 0.3)")
      .in(Range::within(0.0, 100.0));
  command
      .option("--rate", options.rate_hz,
              "Sample rate [Hz] of the gain file and of discrete-time designs (default: 1000)")
      .in(Range::within(lowest_sample_rate_hz, highest_sample_rate_hz));
  command
      .option("--cutoff", options.cutoff_hz,
              "Velocity filter of the gain file: cutoff frequency [Hz] (default: 50)")
      .in(Range::positive());
  command
      .option("--damping", options.damping, "Velocity filter of the gain file: damping ratio (default: 0.9)")
      .in(Range::positive());
}

}  // namespace

void add_design(CommandLine& line) {
  const Command command = line.command(
      "design", "Design gains for a plant by linear-quadratic regulation (LQR)",
      "Examples:\n"
      "  upright design config/plants/exponential.yaml --q 5000,3000,20,20 --r 1 --out gains.yaml\n"
      "  upright design config/plants/viscous.yaml --delay 0.1 --rate 1000 --out compensated.yaml\n"
      "  upright design config/plants/viscous.yaml --estimator kalman --out quiet.yaml\n"
      "  upright design config/plants/exponential.yaml --estimator extended_kalman --out quieter.yaml\n"
      "  upright design config/plants/viscous.yaml --estimator kalman --for-delay 0.04 --out slow-link.yaml\n"
      "With --delay, the gain file has a predictor: the gains act on the state that is predicted for the\n"
      "moment when the voltage acts.");
  const auto options = std::make_shared<DesignOptions>();
  command.option("plant", options->plant, "Plant file").required();
  command
      .option("--q", options->q,
              "Weights on x, theta, x_dot, theta_dot (default: 5000,3000,20,20; with --estimator "
              "2250,2500,10,20)")
      .list_of(4)
      .in(Range::not_negative());
  command.option("--r", options->r, "Weight on the voltage (default: 1)").in(Range::positive());
  command
      .option(
          "--estimator", options->estimator,
          "none: velocity filter (default). kalman: linear Kalman filter; it also estimates the force on the "
          "cart that the linear model lacks, dry friction included, and compensates for it. extended_kalman: "
          "predicts with every effect of the plant file, and compensates for its friction too")
      .one_of({no_estimator, "kalman", extended_estimator});
  command
      .option(
          "--uncertainty", options->uncertainty,
          "With --estimator: relative parameter error that the loop must survive without a fall (default: "
          "0.05). A design that does not is refused")
      .in(Range::within(0.0, 0.5));
  command
      .option("--smoothing", options->smoothing,
              "To linearize, replace sgn(v) by tanh(SMOOTHING v) (default: 100)")
      .in(Range::positive());
  add_loop_options(command, *options);
  command.option("--out", options->out, "Gain file to write");
  command.flag("--force", options->force, "Replace an existing gain file");
  command.flag("--json", options->as_json, "Print one JSON document");
  command.does([options] {
    design(*options);
    return ExitCode::done;
  });
}

}  // namespace upright::cli
