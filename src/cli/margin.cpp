// `upright margin`: how much delay a plant with its gains tolerates.
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "commands.hpp"
#include "design/delay_margin.hpp"
#include "design/physical_limits.hpp"
#include "json_number.hpp"
#include "model/linear_plant.hpp"
#include "progress.hpp"
#include "runtime/overrun_limit.hpp"
#include "upright/model/plant_file.hpp"

namespace upright::cli {

namespace {

using Json = nlohmann::ordered_json;

struct MarginOptions {
  std::string plant;
  std::string gains;
  double smoothing = 100.0;
  bool as_json = false;
};

struct Margins {
  LoopMargin continuous, sampled, sliding;
  OverrunLimit limit;
  std::optional<LoopMargin> unmodelled;  ///< with a state estimator: of an actuator slower than its model
  PhysicalLimits physics;
};

constexpr const char* extended_note =
    "The extended Kalman filter is taken as its line while the cart slides, as a stationary one on the same "
    "plant: neither the friction in its prediction nor friction_compensation is in these margins. `upright "
    "design` judges both by simulated runs.";

Json json_of(std::complex<double> root) {
  return {root.real(), root.imag()};
}

Json json_of(const Crossing& crossing) {
  return {{"frequency_radps", crossing.frequency_radps},
          {"delay_s", crossing.delay_s},
          {"destabilizing", crossing.destabilizing}};
}

Json json_of(const Confirmation& found) {
  return {{"confirmed", found.confirmed},
          {"below", {{"delay_s", found.below_s}, {"rightmost_root", json_of(found.below)}}},
          {"above", {{"delay_s", found.above_s}, {"rightmost_root", json_of(found.above)}}}};
}

Json json_of(const LoopMargin& margin) {
  Json crossings = Json::array();
  for (const Crossing& crossing : margin.crossings) crossings.push_back(json_of(crossing));
  return {{"critical_delay_s", finite_or_null(margin.critical_delay_s)},
          {"crossing_radps", margin.crossing_radps > 0.0 ? Json(margin.crossing_radps) : Json(nullptr)},
          {"crossings", crossings},
          {"stable_without_delay", margin.stable_without_delay},
          {"rightmost_root_without_delay", json_of(margin.root_without_delay)},
          {"roots", margin.confirmation ? json_of(*margin.confirmation) : Json(nullptr)}};
}

bool predicts(const ControlConfig& config) {
  return config.compensation.kind == CompensationKind::predictor;
}

std::string milliseconds(double seconds) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g ms", 1e3 * seconds);
  return text;
}

/// The delay that the loop tolerates on the rig, and how much of it remains.
std::string verdict_for(const Margins& margins, const ControlConfig& config) {
  if (!margins.limit.warning.empty()) return margins.limit.warning;
  const OverrunTolerance& tolerance = *margins.limit.tolerance;
  const std::string how =
      std::string(" (sampled, while the cart slides") + (predicts(config) ? ", with its predictor)" : ")");
  if (!std::isfinite(tolerance.critical_delay_s)) return "on the rig the loop tolerates any delay" + how;
  return "on the rig the loop tolerates " + milliseconds(tolerance.critical_delay_s) + " of delay" + how +
         "; it is configured with " + milliseconds(config.delay_s) + ", so that " +
         milliseconds(tolerance.extra_delay_s) + " remain, " + std::to_string(tolerance.missed_periods) +
         (tolerance.missed_periods == 1 ? " missed period" : " missed periods") + " in a row";
}

Json json_of(const Margins& margins, const ControlConfig& config) {
  const OverrunTolerance& tolerance = *margins.limit.tolerance;
  Json document{{"verdict",
                 {{"sentence", verdict_for(margins, config)},
                  {"bears_delay_s", finite_or_null(tolerance.critical_delay_s)},
                  {"will_hold", !tolerance.exceeded()}}}};
  document.update(json_of(margins.continuous));
  document["predictor_included"] = !predicts(config);
  document["sampled"] = json_of(margins.sampled);
  document["sampled_sliding"] = json_of(margins.sliding);
  document["sampled_sliding_unmodelled"] = margins.unmodelled ? json_of(*margins.unmodelled) : Json(nullptr);
  document["notes"] = Json::array();
  if (config.state_estimator.kind == StateEstimatorKind::extended_kalman)
    document["notes"].push_back(extended_note);
  document["limits_of_physics"] = {{"unstable_rate_radps", margins.physics.unstable_rate_radps},
                                   {"plant_pole_radps", margins.physics.plant_pole_radps},
                                   {"proportional_derivative_s", margins.physics.proportional_derivative_s},
                                   {"with_acceleration_s", margins.physics.with_acceleration_s},
                                   {"linear_controller_s", margins.physics.linear_controller_s}};
  document["tolerance"] = {{"delay_s", config.delay_s},
                           {"extra_delay_s", finite_or_null(tolerance.extra_delay_s)},
                           {"missed_periods", tolerance.missed_periods},
                           {"sliding", true},
                           {"sentence", tolerance.sentence}};
  return document;
}

/// `at` is the delay at which a loop that is unstable was looked at: none, or what a predictor makes up for.
void print(const std::string& name, const LoopMargin& margin, const std::string& at) {
  std::printf("%s\n", name.c_str());
  if (!margin.stable_without_delay)
    std::printf("  unstable %s (rightmost root %.4g %+.4gi 1/s)\n", at.c_str(),
                margin.root_without_delay.real(), margin.root_without_delay.imag());
  else if (!std::isfinite(margin.critical_delay_s))
    std::printf("  stable with any delay\n");
  else
    std::printf("  critical delay %.6g s, crossing at %.6g rad/s\n", margin.critical_delay_s,
                margin.crossing_radps);
  for (const Crossing& crossing : margin.crossings)
    std::printf("  crossing %12.6g rad/s at %10.6g s, %s\n", crossing.frequency_radps, crossing.delay_s,
                crossing.destabilizing ? "destabilizing" : "stabilizing");
  if (const auto& found = margin.confirmation)
    std::printf("  rightmost root %+.3e at %.6g s, %+.3e at %.6g s: %s\n", found->below.real(),
                found->below_s, found->above.real(), found->above_s,
                found->confirmed ? "confirmed" : "NOT confirmed");
}

void print(const Margins& margins, const ControlConfig& config) {
  std::printf("Verdict: %s.\n\n", verdict_for(margins, config).c_str());
  const std::string without = "without any delay";
  const std::string at = predicts(config)
                             ? "at the " + milliseconds(config.delay_s) + " that its predictor compensates"
                             : without;
  const std::string estimator = config.has_state_estimator() ? "state estimator" : "velocity estimator";
  const std::string parts = "hold, " + estimator + ", delay line" + (predicts(config) ? ", predictor" : "");
  print("sampled loop while the cart slides (" + parts + "; no dry friction); the verdict uses this loop",
        margins.sliding, at);
  print("sampled loop near rest (" + parts + "; dry friction smoothed)", margins.sampled, at);
  if (!margins.sampled.stable_without_delay && !margins.limit.tolerance->exceeded())
    std::printf("  the loop balances, but it does not come to rest: it shows stick-slip\n");
  print(predicts(config) ? "continuous loop of the gains without the predictor (not the loop that runs)"
        : config.has_state_estimator()
            ? "continuous loop near rest (no hold; continuous-time estimator; dry friction smoothed)"
            : "continuous loop near rest (no hold, no estimator; dry friction smoothed)",
        margins.continuous, without);
  if (margins.unmodelled)
    print(
        "sampled loop with an actuator delay that the estimator does not know (in addition to the gain "
        "file's delay)",
        *margins.unmodelled, at);
  if (config.state_estimator.kind == StateEstimatorKind::extended_kalman) std::printf("%s\n", extended_note);
  const PhysicalLimits& physics = margins.physics;
  std::printf(
      "Theoretical limits of the delay for this pendulum: %s with feedback of angle and rate (Stepan); %s "
      "with acceleration as well (Insperger, Milton, Stepan); %s for any linear controller that also "
      "stabilizes the loop without delay (Middleton, Miller).\n",
      milliseconds(physics.proportional_derivative_s).c_str(),
      milliseconds(physics.with_acceleration_s).c_str(), milliseconds(physics.linear_controller_s).c_str());
  std::fflush(stdout);
}

void margin(const MarginOptions& options) {
  Progress progress("margin");
  const Plant plant = read_plant_file(options.plant);
  const ControlConfig config = read_gain_file(options.gains);
  Margins margins{continuous_margin(plant, config, options.smoothing),
                  sampled_margin(plant, config, options.smoothing),
                  sampled_margin(large_motion_plant(plant), config, options.smoothing),
                  overrun_limit(plant, config),
                  std::nullopt,
                  physical_limits(plant)};
  if (config.has_state_estimator())
    margins.unmodelled =
        sampled_margin(large_motion_plant(plant), config, options.smoothing, true, ExtraDelay::unmodelled);
  progress.end();
  if (options.as_json)
    std::cout << json_of(margins, config).dump(2) << "\n";
  else
    print(margins, config);
}

}  // namespace

void add_margin(CommandLine& line) {
  const Command command =
      line.command("margin", "Compute how much delay the closed loop tolerates",
                   "Example:  upright margin config/plants/exponential.yaml config/gains/exponential.yaml");
  const auto options = std::make_shared<MarginOptions>();
  command.option("plant", options->plant, "Plant file").required();
  command.option("gains", options->gains, "Gain file").required();
  command
      .option("--smoothing", options->smoothing,
              "To linearize, replace sgn(v) by tanh(SMOOTHING v) (default: 100)")
      .in(Range::positive());
  command.flag("--json", options->as_json, "Print one JSON document");
  command.does([options] {
    margin(*options);
    return ExitCode::done;
  });
}

}  // namespace upright::cli
