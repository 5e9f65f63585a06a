#include "parameter_trials.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>

#include "base/parallel.hpp"
#include "control/filter_model.hpp"
#include "sim/loop/loop_run.hpp"
#include "uncertain_parameters.hpp"
#include "upright/control/model_parts.hpp"

namespace upright {

namespace {

constexpr double start_rad = 3.0 * std::numbers::pi / 180.0;
/// Long enough for a loop that does not hold to fall, and for a limit cycle to settle.
constexpr double trial_s = 9.0;

LoopResult trial_of(const Plant& plant, const Plant& model, const ControlConfig& config) {
  const Resolution steps = resolution_of(config.state_estimator);
  LoopSetup setup;
  setup.model = make_model<double>(plant);
  setup.sampled = true;
  setup.cart_resolution_m = steps.cart_m;
  setup.angle_resolution_rad = steps.angle_rad;
  setup.control = config;
  setup.duration_s = trial_s;
  setup.make_parts = [&model](const ControlConfig& asked) { return make_model_parts(asked, model, model); };
  return run_with_events(setup, {start_rad, config.delay_s});
}

std::string error_text(const UncertainParameter& parameter, double by) {
  char text[120];
  std::snprintf(text, sizeof text, "%s %.3g percent %s", parameter.name.c_str(), 100.0 * std::abs(by - 1.0),
                by < 1.0 ? "lower" : "higher");
  return text;
}

/// Every parameter up or down, as the bits of a generator say that is the same everywhere.
Plant all_off(const Plant& plant, const std::vector<UncertainParameter>& parameters, double uncertainty,
              unsigned seed) {
  Plant off = plant;
  std::mt19937 random(seed);
  for (const UncertainParameter& parameter : parameters)
    parameter.scale(off, (random() & 1u) != 0 ? 1.0 + uncertainty : 1.0 - uncertainty);
  return off;
}

}  // namespace

ParameterTrials try_parameters(const Plant& plant, const ControlConfig& config, double uncertainty,
                               int together) {
  const std::vector<UncertainParameter> parameters = uncertain_parameters(plant);
  const std::size_t alone = 2 * parameters.size();
  const auto error_of = [&](std::size_t i) { return i % 2 == 0 ? 1.0 - uncertainty : 1.0 + uncertainty; };
  std::vector<LoopResult> results(alone + static_cast<std::size_t>(together));
  parallel_for(results.size(), [&](std::size_t i) {
    Plant off = plant;
    if (i < alone)
      parameters[i / 2].scale(off, error_of(i));
    else
      off = all_off(plant, parameters, uncertainty, static_cast<unsigned>(i - alone));
    results[i] = trial_of(off, plant, config);
  });
  ParameterTrials trials;
  trials.runs = static_cast<int>(results.size());
  trials.hunting_m = 2.0 * trial_of(plant, plant, config).cart_amplitude_m;
  double worst_alone_m = -1.0;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const LoopResult& result = results[i];
    if (result.fell())
      ++trials.fell;
    else
      trials.largest_hunting_m = std::max(trials.largest_hunting_m, 2.0 * result.cart_amplitude_m);
    const double alone_m =
        result.fell() ? std::numeric_limits<double>::infinity() : 2.0 * result.cart_amplitude_m;
    if (i >= alone || !(alone_m > worst_alone_m)) continue;
    worst_alone_m = alone_m;
    trials.one_alone_falls = result.fell();
    trials.most_sensitive_to = error_text(parameters[i / 2], error_of(i));
  }
  return trials;
}

}  // namespace upright
