#include "upright/control/gain_file.hpp"

#include <fstream>

#include "upright/base/error.hpp"
#include "upright/control/delay_line.hpp"

namespace upright {

namespace {

constexpr const char* second_order_name = "second_order_filter";
constexpr const char* difference_name = "difference";

EstimatorConfig read_estimator(const YamlMap& map) {
  EstimatorConfig config;
  if (map.choice("kind", {second_order_name, difference_name}) == difference_name) {
    config.kind = EstimatorKind::difference;
  } else {
    config.cutoff_hz = map.number("cutoff_hz", {0.0, 1e5, true});
    config.damping = map.number("damping", {0.0, 100.0, true});
  }
  map.finish();
  return config;
}

constexpr const char* kalman_name = "kalman";
constexpr const char* extended_name = "extended_kalman";

struct OptionalNumber {
  const char* key;
  std::optional<double> StateEstimatorConfig::*value;
  bool may_be_zero;
};

constexpr OptionalNumber estimator_numbers[] = {
    {"cart_force_noise_n2_per_s", &StateEstimatorConfig::cart_force_noise_n2_per_s, true},
    {"angle_zero_noise_rad2_per_s", &StateEstimatorConfig::angle_zero_noise_rad2_per_s, true},
    {"cart_noise_m2_per_s3", &StateEstimatorConfig::cart_noise_m2_per_s3, false},
    {"pendulum_noise_rad2_per_s3", &StateEstimatorConfig::pendulum_noise_rad2_per_s3, false},
    {"cart_resolution_m", &StateEstimatorConfig::cart_resolution_m, false},
    {"angle_resolution_rad", &StateEstimatorConfig::angle_resolution_rad, false},
    {"angle_noise_counts2", &StateEstimatorConfig::angle_noise_counts2, false},
};

StateEstimatorConfig read_state_estimator(const YamlMap& map) {
  StateEstimatorConfig config;
  config.kind = map.choice("kind", {kalman_name, extended_name}) == kalman_name
                    ? StateEstimatorKind::kalman
                    : StateEstimatorKind::extended_kalman;
  config.plant = map.path("plant");
  // Far beyond any rig, and far from where the Riccati equation loses its digits.
  constexpr double largest = 1e9, smallest = 1e-15;
  for (const OptionalNumber& number : estimator_numbers) {
    config.*number.value = map.optional_number(number.key, Range::within(0.0, largest));
    const std::optional<double>& value = config.*number.value;
    if (value && *value < smallest && !(number.may_be_zero && *value == 0.0))
      map.fail(number.key, "is too small", "set it to at least " + exact_text(smallest));
  }
  map.finish();
  return config;
}

DisturbanceRejection read_rejection(const YamlMap& map) {
  DisturbanceRejection rejection;
  rejection.share = map.number("share", Range::within(0.0, 1.0));
  rejection.decay_s = map.number_or("decay_s", 0.0, Range::not_negative());
  map.finish();
  return rejection;
}

FrictionCompensation read_friction(const YamlMap& map) {
  FrictionCompensation friction;
  friction.share = map.number("share", Range::within(0.0, 1.0));
  friction.lag_s = map.number_or("lag_s", friction.lag_s, Range::not_negative());
  map.finish();
  return friction;
}

DelayCompensation read_compensation(const YamlMap& map) {
  DelayCompensation compensation;
  if (map.choice("kind", {"none", "predictor"}) == "predictor") {
    compensation.kind = CompensationKind::predictor;
    compensation.plant = map.path("plant");
  }
  map.finish();
  return compensation;
}

Gains read_gain_numbers(const YamlMap& map) {
  Gains gains;
  gains.cart_position_v_per_m = map.number("cart_position_v_per_m");
  gains.pendulum_angle_v_per_rad = map.number("pendulum_angle_v_per_rad");
  gains.cart_velocity_v_per_mps = map.number("cart_velocity_v_per_mps");
  gains.pendulum_rate_v_per_radps = map.number("pendulum_rate_v_per_radps");
  map.finish();
  return gains;
}

std::string estimator_text(const EstimatorConfig& config) {
  if (config.kind == EstimatorKind::difference) return std::string("{kind: ") + difference_name + "}";
  return std::string("{kind: ") + second_order_name + ", cutoff_hz: " + exact_text(config.cutoff_hz) +
         ", damping: " + exact_text(config.damping) + "}";
}

/// In single quotes, so that any file name reads back.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'') result += '\'';
    result += c;
  }
  return result + "'";
}

std::string state_estimator_text(const ControlConfig& config) {
  const StateEstimatorConfig& estimator = config.state_estimator;
  const bool extended = estimator.kind == StateEstimatorKind::extended_kalman;
  std::string text = std::string("state_estimator: {kind: ") + (extended ? extended_name : kalman_name) +
                     ", plant: " + quoted(estimator.plant.string());
  for (const OptionalNumber& number : estimator_numbers)
    if (const std::optional<double>& value = estimator.*number.value)
      text += std::string(",\n                  ") + number.key + ": " + exact_text(*value);
  text += "}\ndisturbance_rejection: {share: " + exact_text(config.rejection.share);
  if (config.rejection.decay_s > 0.0) text += ", decay_s: " + exact_text(config.rejection.decay_s);
  text += "}\n";
  if (extended)
    text += "friction_compensation: {share: " + exact_text(config.friction.share) +
            ", lag_s: " + exact_text(config.friction.lag_s) + "}\n";
  return text;
}

}  // namespace

ControlConfig read_gains(const YamlMap& document) {
  ControlConfig config;
  config.gains = read_gain_numbers(document.map("gains"));
  config.delay_s = document.number("delay_s", Range::within(0.0, DelayLine::longest_delay_s));
  config.sample_rate_hz =
      document.number("sample_rate_hz", Range::within(lowest_sample_rate_hz, highest_sample_rate_hz));
  if (const auto estimator = document.optional_map("state_estimator"))
    config.state_estimator = read_state_estimator(*estimator);
  if (const auto rejection = document.optional_map("disturbance_rejection")) {
    config.rejection = read_rejection(*rejection);
    if (!config.has_state_estimator())
      document.fail("disturbance_rejection", "needs an estimate of the force on the cart",
                    "add a state_estimator");
  }
  if (const auto friction = document.optional_map("friction_compensation")) {
    config.friction = read_friction(*friction);
    if (config.state_estimator.kind != StateEstimatorKind::extended_kalman)
      document.fail("friction_compensation", "needs a model of the friction",
                    "use state_estimator: {kind: extended_kalman} and a plant file with friction");
  }
  if (config.has_state_estimator() && !document.has("velocity_estimator"))
    config.estimator = {};
  else
    config.estimator = read_estimator(document.map("velocity_estimator"));
  if (const auto compensation = document.optional_map("delay_compensation"))
    config.compensation = read_compensation(*compensation);
  document.finish();
  return config;
}

ControlConfig read_gain_file(const std::filesystem::path& file) {
  return read_gains(YamlMap::from_file(file));
}

std::string gain_text(const ControlConfig& config, const std::vector<std::string>& comments) {
  const Gains& k = config.gains;
  std::string text;
  for (const std::string& comment : comments) text += "# " + comment + "\n";
  text += "gains: {cart_position_v_per_m: " + exact_text(k.cart_position_v_per_m) +
          ", pendulum_angle_v_per_rad: " + exact_text(k.pendulum_angle_v_per_rad) +
          ",\n        cart_velocity_v_per_mps: " + exact_text(k.cart_velocity_v_per_mps) +
          ", pendulum_rate_v_per_radps: " + exact_text(k.pendulum_rate_v_per_radps) + "}\n";
  text += "delay_s: " + exact_text(config.delay_s) + "\n";
  text += "sample_rate_hz: " + exact_text(config.sample_rate_hz) + "\n";
  text += "velocity_estimator: " + estimator_text(config.estimator) + "\n";
  if (config.has_state_estimator()) text += state_estimator_text(config);
  if (config.compensation.kind == CompensationKind::predictor)
    text +=
        "delay_compensation: {kind: predictor, plant: " + quoted(config.compensation.plant.string()) + "}\n";
  else
    text += "delay_compensation: {kind: none}\n";
  return text;
}

void write_gain_file(const ControlConfig& config, const std::filesystem::path& file,
                     const std::vector<std::string>& comments) {
  // Beside it first: on a full disk the file that was there stays, and no half of a new one.
  const std::filesystem::path partial = file.string() + ".partial";
  std::ofstream out(partial, std::ios::binary);
  out << gain_text(config, comments);
  out.close();
  std::error_code problem;
  if (out) std::filesystem::rename(partial, file, problem);
  if (out && !problem) return;
  std::error_code ignored;
  std::filesystem::remove(partial, ignored);
  throw Error(ExitCode::usage, "cannot write " + file.string() + ": check the folder and its free space");
}

}  // namespace upright
