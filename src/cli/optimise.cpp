// `upright optimise`: gains with the smallest mean cost over the drawn plants of a sweep.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "commands.hpp"
#include "json_number.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "result_folder.hpp"
#include "signals.hpp"
#include "sweep/gain_optimisation.hpp"
#include "upright/base/error.hpp"
#include "upright/control/gain_file.hpp"

namespace upright::cli {

namespace {

using Json = nlohmann::ordered_json;

struct OptimiseArguments {
  std::string file, out;
  OptimisationRequest request;
  bool force = false, as_json = false;
};

/// What the cost is made of, with its units.
std::string cost_text(const RunCost& cost) {
  return "cost of a run: " + exact_text(cost.fall) + " if it falls, else " + exact_text(cost.cart_per_m) +
         " per m of cart amplitude + " + exact_text(cost.angle_per_rad) +
         " per rad of angle amplitude (half of peak to peak over the last third)" +
         (cost.per_v > 0.0 ? " + " + exact_text(cost.per_v) + " per V rms over the last third" : "");
}

Json json_of(const MeanCost& mean) {
  return {{"cost", mean.cost},
          {"share_falls", mean.share_falls},
          {"cart_amplitude_m", finite_or_null(mean.cart_amplitude_m)},
          {"theta_amplitude_rad", finite_or_null(mean.theta_amplitude_rad)},
          {"voltage_rms_v", finite_or_null(mean.voltage_rms_v)}};
}

Json json_of(const std::vector<LinearMargin>& margins) {
  Json all = Json::array();
  for (const LinearMargin& margin : margins)
    all.push_back({{"model", margin.model},
                   {"critical_delay_s", finite_or_null(margin.critical_delay_s)},
                   {"crossing_radps", margin.crossing_radps}});
  return all;
}

Json json_of(const Optimisation& found, const OptimiseArguments& arguments) {
  const RunCost& cost = arguments.request.cost;
  Json numbers = Json::object();
  for (const TunedNumber& number : found.numbers)
    numbers[number.name] = {{"before", number.before}, {"after", number.after}};
  return {{"better", found.is_better()},
          {"fresh_plants",
           {{"seed", found.fresh_seed},
            {"samples", found.fresh_samples},
            {"before", json_of(found.fresh_before)},
            {"after", json_of(found.fresh_after)},
            {"gained", found.gained},
            {"gained_standard_error", found.gained_error}}},
          {"search_plants", {{"before", json_of(found.before)}, {"after", json_of(found.after)}}},
          {"numbers", numbers},
          {"margins", {{"before", json_of(found.margins_before)}, {"after", json_of(found.margins_after)}}},
          {"run_cost",
           {{"fall", cost.fall},
            {"cart_per_m", cost.cart_per_m},
            {"angle_per_rad", cost.angle_per_rad},
            {"per_v", cost.per_v}}},
          {"written_to", arguments.out.empty() ? Json(nullptr) : Json(arguments.out)}};
}

void print_costs(const char* plants, const MeanCost& before, const MeanCost& after) {
  std::printf("%s\n", plants);
  const auto line = [](const char* when, const MeanCost& mean) {
    std::printf(
        "  %-7s cost %8.4f, %5.1f percent of the runs fall, the others: cart %7.2f mm, angle %6.3f degree",
        when, mean.cost, 100.0 * mean.share_falls, 1e3 * mean.cart_amplitude_m,
        57.29577951308232 * mean.theta_amplitude_rad);
    if (std::isfinite(mean.voltage_rms_v)) std::printf(", %.2f V rms", mean.voltage_rms_v);
    std::printf("\n");
  };
  line("before", before);
  line("after", after);
}

void print(const Optimisation& found, const OptimiseArguments& arguments) {
  std::printf("%s\n", cost_text(arguments.request.cost).c_str());
  std::printf("%s: the cost of fresh plants falls by %.4f, with a standard error of %.4f\n",
              found.is_better() ? "better" : "NOT better", found.gained, found.gained_error);
  print_costs(("fresh plants (" + std::to_string(found.fresh_samples) + ", seed " +
               std::to_string(found.fresh_seed) + "), which the search did not see")
                  .c_str(),
              found.fresh_before, found.fresh_after);
  print_costs("plants of the search", found.before, found.after);
  for (const TunedNumber& number : found.numbers)
    std::printf("  %-46s %12.6g -> %12.6g\n", number.name.c_str(), number.before, number.after);
  for (std::size_t i = 0; i < found.margins_before.size(); ++i)
    std::printf("critical delay, linear, %s: %.4g ms -> %.4g ms\n", found.margins_before[i].model.c_str(),
                1e3 * found.margins_before[i].critical_delay_s,
                1e3 * found.margins_after[i].critical_delay_s);
  if (!arguments.out.empty()) std::printf("written to %s\n", arguments.out.c_str());
}

void write_gains(const Optimisation& found, const OptimiseArguments& arguments) {
  if (!found.is_better())
    throw ConfigError("the gains that were found are not better on fresh plants (cost " +
                      exact_text(found.fresh_before.cost) + " before, " + exact_text(found.fresh_after.cost) +
                      " after), so " + arguments.out +
                      " was not written: raise samples in the sweep file, or --evaluations");
  ControlConfig config = found.control;
  if (config.has_state_estimator())
    config.state_estimator.plant = path_from(arguments.out, config.state_estimator.plant);
  if (config.compensation.kind != CompensationKind::none)
    config.compensation.plant = path_from(arguments.out, config.compensation.plant);
  char bought[160];
  std::snprintf(bought, sizeof bought, "Mean cost of %u fresh plants: %.4g before, %.4g after.",
                found.fresh_samples, found.fresh_before.cost, found.fresh_after.cost);
  write_gain_file(config, arguments.out,
                  {"Optimised by `upright optimise` for " + arguments.file + ":",
                   cost_text(arguments.request.cost), bought});
}

ExitCode optimise(const OptimiseArguments& arguments) {
  if (!arguments.out.empty()) refuse_replacing(arguments.out, arguments.force);
  end_on_signal();
  Progress progress("optimise");
  OptimisationRequest request = arguments.request;
  request.progress = progress.callback();
  const Optimisation found = optimise_gains(read_sweep_file(arguments.file), request);
  progress.end();
  if (!arguments.out.empty()) write_gains(found, arguments);
  if (arguments.as_json)
    std::cout << json_of(found, arguments).dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
  else
    print(found, arguments);
  std::fflush(stdout);
  finish_output();
  return ExitCode::done;
}

}  // namespace

void add_optimise(CommandLine& line) {
  const Command command = line.command(
      "optimise", "Improve gains on simulated runs of many plants drawn around a plant file",
      "Example:  upright optimise config/sweeps/optimise-exponential.yaml --out better.yaml\n"
      "The sweep file names the plant, the gains to begin with, starts, delays, and how plants are drawn. "
      "The\n"
      "cost is the mean over all runs. Fresh plants, which the search did not see, judge the result.");
  const auto arguments = std::make_shared<OptimiseArguments>();
  OptimisationRequest& request = arguments->request;
  command.option("sweep", arguments->file, "Sweep file with uncertainty").required();
  command.option("--out", arguments->out, "Gain file to write, if the gains are better on fresh plants");
  command.option("--fall-cost", request.cost.fall, "Cost of a run that falls (default: 1)")
      .in(Range::not_negative());
  command
      .option("--cart-cost", request.cost.cart_per_m,
              "Cost per metre of the cart's amplitude, of a run that does not fall [1/m] (default: 10)")
      .in(Range::not_negative());
  command
      .option("--angle-cost", request.cost.angle_per_rad,
              "Cost per radian of the pendulum's amplitude, of a run that does not fall [1/rad] (default: 1)")
      .in(Range::not_negative());
  command
      .option("--voltage-cost", request.cost.per_v,
              "Cost per volt (root mean square of the command over the last third), of a run that does not "
              "fall, in sampled loops [1/V] (default: 0)")
      .in(Range::not_negative());
  command
      .option("--evaluations", request.evaluations, "Largest number of gains that are tried (default: 200)")
      .from_to(10, 100000);
  command.option("--seed", request.seed, "Of the search (default: 1)").from_to(0u, 1000000000u);
  command.flag("--force", arguments->force, "Replace the gain file if it exists");
  command.flag("--json", arguments->as_json, "Print one JSON document");
  command.does([arguments] { return optimise(*arguments); });
}

}  // namespace upright::cli
