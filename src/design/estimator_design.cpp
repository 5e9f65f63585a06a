#include "estimator_design.hpp"

#include <algorithm>
#include <cstdio>

#include "control/filter_model.hpp"
#include "delay_margin.hpp"
#include "model/linear_plant.hpp"
#include "uncertain_parameters.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

/// Dry friction is gone from the plants that margins are taken of.
constexpr double any_smoothing = 100.0;

/// Variance of the angle's reading. At rest the error of a rounded angle keeps its sign for many periods, so
/// that, as the white noise of the filter, it counts as much more than 1/12. Of the values tried, 1/12 to 2,
/// this one let the cart hunt least on the paper's plants; see docs/explanation/quiet-control.md.
constexpr double angle_noise_counts2 = 0.6;
/// The zero of the angle is found within some ten seconds. Quicker, it follows the hunting of the pendulum.
constexpr double angle_zero_noise_rad2_per_s = 2e-7;

/// With a predictor, friction is carried forward over the delay, in which it may turn round: it is followed
/// less eagerly, and fades. Measured on the paper's plants at 10 to 300 ms; see
/// docs/results/quiet-control.md.
constexpr double predicted_force_share = 0.25;
constexpr double predicted_force_decay_s = 0.115;
/// With a long delay it fades the quicker the longer the delay: decay times delay is at most this.
constexpr double decay_times_delay_s2 = 0.015;

double remaining_delay_margin_s(const Plant& plant, const ControlConfig& config, ExtraDelay extra) {
  const LoopMargin margin = sampled_margin(plant, config, any_smoothing, false, extra);
  return margin.stable_without_delay ? std::max(0.0, margin.critical_delay_s - config.delay_s) : 0.0;
}

ControlConfig first_config(const Plant& plant, const EstimatorRequest& request,
                           const std::array<double, 4>& k) {
  ControlConfig config;
  config.gains = {k[0], k[1], k[2], k[3]};
  config.delay_s = request.delay_s ? *request.delay_s : request.for_delay_s.value_or(0.0);
  config.sample_rate_hz = request.rate_hz;
  config.state_estimator.kind = request.kind;
  config.state_estimator.plant = request.plant_file;
  config.state_estimator.angle_noise_counts2 = angle_noise_counts2;
  config.state_estimator.angle_zero_noise_rad2_per_s = angle_zero_noise_rad2_per_s;
  double noise = process_noise_of(config.state_estimator, plant).cart_force_n2_per_s;
  if (request.delay_s) {
    config.compensation = {CompensationKind::predictor, request.plant_file};
    config.rejection.decay_s =
        std::min(predicted_force_decay_s, decay_times_delay_s2 / std::max(*request.delay_s, 1e-9));
    config.state_estimator.angle_zero_noise_rad2_per_s = 0.0;  // it costs falls at long delays
    noise *= predicted_force_share;
  }
  config.state_estimator.cart_force_noise_n2_per_s = noise;
  return config;
}

constexpr const char* what_helps = "raise --r, shorten the delay, or lower --uncertainty";

void refuse_sensitive(const std::string& parameter) {
  if (!parameter.empty())
    throw ConfigError("the loop does not balance with " + parameter +
                      " than in the plant file: " + what_helps);
}

void refuse_falls(const ParameterTrials& trials, double uncertainty) {
  if (trials.fell == 0) return;
  if (trials.one_alone_falls) refuse_sensitive(trials.most_sensitive_to);
  throw ConfigError("with every parameter " + exact_text(100.0 * uncertainty) + " percent wrong, " +
                    std::to_string(trials.fell) + " of " + std::to_string(trials.runs) +
                    " simulated runs fell, and the loop is most sensitive to " + trials.most_sensitive_to +
                    ": " + what_helps);
}

}  // namespace

std::string destabilising_parameter(const Plant& plant, const ControlConfig& config, double uncertainty) {
  for (const UncertainParameter& parameter : uncertain_parameters(large_motion_plant(plant)))
    for (const double by : {1.0 - uncertainty, 1.0 + uncertainty}) {
      Plant off = large_motion_plant(plant);
      parameter.scale(off, by);
      const LinearSampledLoop loop(off, config, any_smoothing, ExtraDelay::unmodelled);
      if (loop.rightmost_root(0.0).real() < 0.0) continue;
      char text[120];
      std::snprintf(text, sizeof text, "%s %.3g percent %s", parameter.name.c_str(), 100.0 * uncertainty,
                    by < 1.0 ? "lower" : "higher");
      return text;
    }
  return "";
}

EstimatorDesign design_with_estimator(const Plant& plant, const EstimatorRequest& request) {
  const Plant sliding = large_motion_plant(plant);
  EstimatorDesign design;
  design.gains = design_sampled_gains(sliding, request.weights, request.smoothing, request.rate_hz,
                                      request.delay_s.value_or(0.0));
  design.config = first_config(plant, request, design.gains.design.gains);
  std::optional<double>& noise = design.config.state_estimator.cart_force_noise_n2_per_s;
  // A predictor's horizon decides what it bears, hardly the force noise: one period is asked of it.
  const double wanted_s = request.delay_s ? design.config.period_s() : slow_actuator_s;
  if (request.for_delay_s) {
    const MarginRequest margin{request.weights, request.smoothing, request.cost_loss, slow_actuator_s};
    design.widened = widen_margin(sliding, margin, design.config);
    adopt(*design.widened, design.gains.design);
  }
  constexpr int max_halvings = 12;
  for (int i = 0; i <= max_halvings; ++i) {
    design.unmodelled_delay_margin_s =
        remaining_delay_margin_s(sliding, design.config, ExtraDelay::unmodelled);
    if (design.unmodelled_delay_margin_s >= wanted_s) break;
    if (i < max_halvings) *noise *= 0.5;
  }
  if (design.unmodelled_delay_margin_s <= 0.0)
    throw ConfigError(
        "the loop is unstable even with the slowest estimator of the force on the cart: raise --r or the "
        "sample rate, or shorten the delay");
  refuse_sensitive(destabilising_parameter(plant, design.config, request.uncertainty));
  if (!request.delay_s) {
    constexpr int together = 40;
    design.trials = try_parameters(plant, design.config, request.uncertainty, together);
    refuse_falls(*design.trials, request.uncertainty);
  }
  design.delay_margin_s = remaining_delay_margin_s(sliding, design.config, ExtraDelay::known);
  return design;
}

}  // namespace upright
