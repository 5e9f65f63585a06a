#include "gain_optimisation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <numbers>

#include "base/parallel.hpp"
#include "derivative_free_search.hpp"
#include "design/delay_margin.hpp"
#include "sweep_stages.hpp"
#include "sweep_tasks.hpp"
#include "upright/base/error.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/model/elementary.hpp"

namespace upright {

namespace {

/// Logarithms of the factors by which the numbers change: within a factor of two in the global search, of
/// eight in the local one, beyond which the start says nothing any more.
constexpr SearchBounds bounds{std::numbers::ln2, 3.0 * std::numbers::ln2};

/// As many fresh plants for one of the search.
constexpr std::uint32_t fresh_for_one = 4;

struct Tuned {
  std::string name;
  std::function<double&(ControlConfig&)> place;
};

/// The numbers that a factor changes, and on which the loop of the sweep depends.
std::vector<Tuned> tuned_numbers(ControlConfig control, bool sampled) {
  std::vector<Tuned> numbers{{"gains.cart_position_v_per_m",
                              [](ControlConfig& c) -> double& { return c.gains.cart_position_v_per_m; }},
                             {"gains.pendulum_angle_v_per_rad",
                              [](ControlConfig& c) -> double& { return c.gains.pendulum_angle_v_per_rad; }},
                             {"gains.cart_velocity_v_per_mps",
                              [](ControlConfig& c) -> double& { return c.gains.cart_velocity_v_per_mps; }},
                             {"gains.pendulum_rate_v_per_radps",
                              [](ControlConfig& c) -> double& { return c.gains.pendulum_rate_v_per_radps; }}};
  if (control.has_state_estimator()) {
    if (control.state_estimator.cart_force_noise_n2_per_s)
      numbers.push_back({"state_estimator.cart_force_noise_n2_per_s", [](ControlConfig& c) -> double& {
                           return *c.state_estimator.cart_force_noise_n2_per_s;
                         }});
  } else if (sampled && control.estimator.kind == EstimatorKind::second_order_filter) {
    numbers.push_back(
        {"velocity_estimator.cutoff_hz", [](ControlConfig& c) -> double& { return c.estimator.cutoff_hz; }});
  }
  std::erase_if(numbers, [&](const Tuned& number) { return number.place(control) == 0.0; });
  return numbers;
}

ControlConfig with_factors(ControlConfig control, const std::vector<Tuned>& numbers,
                           const std::vector<double>& logarithms) {
  for (std::size_t i = 0; i < numbers.size(); ++i)
    numbers[i].place(control) *= elementary::exp(logarithms[i]);
  return control;
}

/// Sums over the runs of one plant.
struct PlantSums {
  double cost = 0.0, cart_m = 0.0, theta_rad = 0.0, voltage_v = 0.0;
  std::size_t falls = 0;
};

PlantSums sums_of(std::span<const LoopResult> runs, const RunCost& cost) {
  PlantSums sums;
  for (const LoopResult& run : runs) {
    if (run.fell()) {
      ++sums.falls;
      sums.cost += cost.fall;
      continue;
    }
    sums.cart_m += run.cart_amplitude_m;
    sums.theta_rad += run.theta_amplitude_rad;
    sums.voltage_v += run.voltage_rms_v;
    sums.cost += cost.cart_per_m * run.cart_amplitude_m + cost.angle_per_rad * run.theta_amplitude_rad;
    if (cost.per_v > 0.0) sums.cost += cost.per_v * run.voltage_rms_v;
  }
  return sums;
}

/// The critical delays of the linear loop. None with a predictor, whose gains depend on the delay.
std::vector<LinearMargin> margins_of(SweepConfig config, const ControlConfig& control) {
  if (control.compensation.kind != CompensationKind::none) return {};
  config.setup.control = control;
  config.setup.make_parts = {};  // the margin of an estimator's loop is that of its line
  return linear_margins(config);
}

/// Mean costs one after the other, with the progress of all.
class Costs {
 public:
  Costs(const OptimisationRequest& request, std::uint32_t samples)
      : request_(request),
        samples_(samples),
        plants_((request.evaluations + 2 + 2 * fresh_for_one) * samples) {}

  MeanCost of(const SweepConfig& config) {
    const MeanCost mean = mean_cost(config, request_.cost);
    done_ += config.uncertainty->samples;
    if (config.uncertainty->samples == samples_) smallest_ = std::min(smallest_, mean.cost);
    char text[48];
    std::snprintf(text, sizeof text, "smallest cost %.4g", smallest_);
    if (request_.progress) request_.progress(done_ / plants_, text);
    return mean;
  }

 private:
  const OptimisationRequest& request_;
  std::uint32_t samples_;
  double plants_, done_ = 0.0;
  double smallest_ = std::numeric_limits<double>::infinity();
};

void compare_on_fresh_plants(SweepConfig config, const ControlConfig& found, Costs& costs,
                             Optimisation& result) {
  result.fresh_seed = config.uncertainty->seed + 1;
  result.fresh_samples = fresh_for_one * config.uncertainty->samples;
  config.uncertainty->seed = result.fresh_seed;
  config.uncertainty->samples = result.fresh_samples;
  result.fresh_before = costs.of(config);
  config.setup.control = found;
  result.fresh_after = costs.of(config);
  const double n = result.fresh_samples;
  double squares = 0.0;
  result.gained = result.fresh_before.cost - result.fresh_after.cost;
  for (std::size_t i = 0; i < result.fresh_samples; ++i) {
    const double gain = result.fresh_before.of_plant[i] - result.fresh_after.of_plant[i] - result.gained;
    squares += gain * gain;
  }
  result.gained_error = std::sqrt(squares / (n * std::max(1.0, n - 1.0)));
}

}  // namespace

bool Optimisation::is_better() const {
  constexpr double half_width = 1.96;  // of a 95 percent interval, in standard errors
  return gained > half_width * gained_error;
}

MeanCost mean_cost(const SweepConfig& config, const RunCost& cost) {
  const std::vector<LoopCase> cases = grid_cases(config);
  std::vector<PlantSums> sums(config.uncertainty->samples);
  // As many plants at once as keep the lanes busy.
  const std::size_t together = (runs_per_call(config) + cases.size() - 1) / cases.size();
  parallel_for((sums.size() + together - 1) / together, [&](std::size_t block) {
    const std::size_t first = block * together, count = std::min(together, sums.size() - first);
    const std::vector<LoopResult> runs =
        run_plants(config, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(count), cases);
    for (std::size_t i = 0; i < count; ++i)
      sums[first + i] = sums_of(std::span(runs).subspan(i * cases.size(), cases.size()), cost);
  });
  MeanCost mean;
  const auto runs = static_cast<double>(cases.size());
  double falls = 0.0;
  for (const PlantSums& plant : sums) {
    mean.of_plant.push_back(plant.cost / runs);
    mean.cost += plant.cost;
    falls += static_cast<double>(plant.falls);
    mean.cart_amplitude_m += plant.cart_m;
    mean.theta_amplitude_rad += plant.theta_rad;
    mean.voltage_rms_v += plant.voltage_v;
  }
  const double all = runs * static_cast<double>(sums.size());
  mean.cost /= all;
  mean.share_falls = falls / all;
  const double standing = falls < all ? all - falls : std::numeric_limits<double>::quiet_NaN();
  mean.cart_amplitude_m /= standing;
  mean.theta_amplitude_rad /= standing;
  mean.voltage_rms_v /= standing;
  return mean;
}

Optimisation optimise_gains(const SweepConfig& config, const OptimisationRequest& request) {
  if (!config.uncertainty)
    throw ConfigError(
        "the sweep has no uncertainty, so that there are no plants to optimise for: add uncertainty: "
        "{percent, samples, seed} to its file");
  if (request.cost.per_v > 0.0 && !config.setup.sampled)
    throw ConfigError(
        "the voltage of a continuous loop has no cost: set loop: sampled in the sweep file, or leave out "
        "--voltage-cost");
  const std::vector<Tuned> numbers = tuned_numbers(config.setup.control, config.setup.sampled);
  if (numbers.empty())
    throw ConfigError(config.gain_file.string() +
                      " has no gain that is not zero: start from gains that upright design wrote");
  SweepConfig trial = config;
  Costs costs(request, config.uncertainty->samples);
  const auto cost_of = [&](const std::vector<double>& logarithms) {
    trial.setup.control = with_factors(config.setup.control, numbers, logarithms);
    return costs.of(trial).cost;
  };
  const std::vector<double> best =
      minimise(numbers.size(), bounds, request.evaluations, request.seed, cost_of);

  Optimisation result;
  result.before = costs.of(config);
  trial.setup.control = with_factors(config.setup.control, numbers, best);
  result.after = costs.of(trial);
  ControlConfig file = read_gain_file(config.gain_file);
  result.control = with_factors(file, numbers, best);
  for (const Tuned& number : numbers)
    result.numbers.push_back({number.name, number.place(file), number.place(result.control)});
  result.margins_before = margins_of(config, config.setup.control);
  result.margins_after = margins_of(config, trial.setup.control);
  compare_on_fresh_plants(config, trial.setup.control, costs, result);
  return result;
}

}  // namespace upright
