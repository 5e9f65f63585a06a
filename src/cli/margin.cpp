// `upright margin`: how much delay a plant with its gains bears.
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "commands.hpp"
#include "upright/analysis/delay_margin.hpp"
#include "upright/model/linear_plant.hpp"
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
  OverrunTolerance tolerance;
};

Json finite_or_null(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

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

Json json_of(const Margins& margins, const ControlConfig& config) {
  Json document = json_of(margins.continuous);
  document["sampled"] = json_of(margins.sampled);
  document["sampled_sliding"] = json_of(margins.sliding);
  document["tolerance"] = {{"delay_s", config.delay_s},
                           {"extra_delay_s", finite_or_null(margins.tolerance.extra_delay_s)},
                           {"missed_periods", margins.tolerance.missed_periods},
                           {"sliding", margins.tolerance.sliding},
                           {"sentence", margins.tolerance.sentence}};
  return document;
}

void print(const char* name, const LoopMargin& margin) {
  std::printf("%s\n", name);
  if (!margin.stable_without_delay)
    std::printf("  unstable without any delay (rightmost root %.4g %+.4gi 1/s)\n",
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

void margin(const MarginOptions& options) {
  const Plant plant = read_plant_file(options.plant);
  const ControlConfig config = read_gain_file(options.gains);
  const Margins margins{continuous_margin(plant, config.gains, options.smoothing),
                        sampled_margin(plant, config, options.smoothing),
                        sampled_margin(sliding_plant(plant), config, options.smoothing),
                        overrun_tolerance(plant, config, options.smoothing)};
  if (options.as_json) {
    std::cout << json_of(margins, config).dump(2) << "\n";
    return;
  }
  print("continuous loop", margins.continuous);
  print("sampled loop (hold, velocity estimator, delay line)", margins.sampled);
  print("sampled loop while the cart slides (no dry friction)", margins.sliding);
  std::printf("%s\n", margins.tolerance.sentence.c_str());
  std::fflush(stdout);
}

}  // namespace

void add_margin(CommandLine& line) {
  const Command command =
      line.command("margin", "How much delay a plant with its gains bears",
                   "Example:  upright margin config/plants/exponential.yaml config/gains/exponential.yaml");
  const auto options = std::make_shared<MarginOptions>();
  command.option("plant", options->plant, "Plant file").required();
  command.option("gains", options->gains, "Gain file").required();
  command.option("--smoothing", options->smoothing, "sgn(v) is taken as tanh(smoothing v)")
      .in(Range::positive());
  command.flag("--json", options->as_json, "One JSON document");
  command.does([options] {
    margin(*options);
    return ExitCode::done;
  });
}

}  // namespace upright::cli
