#include "upright/control/gain_file.hpp"

#include <fstream>

#include "gain_keys.hpp"
#include "upright/base/error.hpp"
#include "upright/control/delay_line.hpp"

namespace upright {

namespace {

constexpr const char* second_order_name = "second_order_filter";
constexpr const char* difference_name = "difference";

constexpr const char* device_name = "device";

constexpr Words<3> velocity_estimators = {second_order_name, difference_name, device_name};

void velocity_estimator_keys(YamlKeys& keys, EstimatorConfig& config) {
  keys.one_of("kind", config.kind, velocity_estimators);
  if (config.kind != EstimatorKind::second_order_filter) return;
  keys.number("cutoff_hz", config.cutoff_hz, {0.0, 1e5, true});
  keys.number("damping", config.damping, {0.0, 100.0, true});
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

constexpr Words<2> state_estimators = {kalman_name, extended_name};
constexpr Words<2> compensations = {"none", "predictor"};

void state_estimator_keys(YamlKeys& keys, StateEstimatorConfig& config) {
  bool is_extended = config.kind == StateEstimatorKind::extended_kalman;
  keys.one_of("kind", is_extended, state_estimators);
  config.kind = is_extended ? StateEstimatorKind::extended_kalman : StateEstimatorKind::kalman;
  keys.path("plant", config.plant);
  // Far beyond any rig, and far from where the Riccati equation loses its digits.
  constexpr double largest = 1e9, smallest = 1e-15;
  for (const OptionalNumber& number : estimator_numbers) {
    std::optional<double>& value = config.*number.value;
    keys.optional_number(number.key, value, Range::within(0.0, largest));
    if (value)
      keys.check_min(number.key, *value, smallest, number.may_be_zero, "is too small",
                     "set it to at least " + exact_text(smallest));
  }
}

void rejection_keys(YamlKeys& keys, DisturbanceRejection& rejection) {
  keys.number("share", rejection.share, Range::within(0.0, 1.0));
  keys.number("decay_s", rejection.decay_s, Range::not_negative(), 0.0);
}

void friction_keys(YamlKeys& keys, FrictionCompensation& friction) {
  keys.number("share", friction.share, Range::within(0.0, 1.0));
  keys.number("lag_s", friction.lag_s, Range::not_negative(), FrictionCompensation{}.lag_s);
}

void compensation_keys(YamlKeys& keys, DelayCompensation& compensation) {
  keys.one_of("kind", compensation.kind, compensations);
  if (compensation.kind == CompensationKind::predictor) keys.path("plant", compensation.plant);
}

void gain_number_keys(YamlKeys& keys, Gains& gains) {
  keys.number("cart_position_v_per_m", gains.cart_position_v_per_m, Range::any());
  keys.number("pendulum_angle_v_per_rad", gains.pendulum_angle_v_per_rad, Range::any());
  keys.number("cart_velocity_v_per_mps", gains.cart_velocity_v_per_mps, Range::any());
  keys.number("pendulum_rate_v_per_radps", gains.pendulum_rate_v_per_radps, Range::any());
}

/// The model-based estimator, and what needs one.
void estimate_keys(YamlKeys& document, ControlConfig& config) {
  if (document.decides_by_presence("state_estimator", config.has_state_estimator()))
    document.deciding_map("state_estimator",
                          [&](YamlKeys& keys) { state_estimator_keys(keys, config.state_estimator); });
  if (document.decides_by_presence("disturbance_rejection", config.has_state_estimator())) {
    document.map("disturbance_rejection", [&](YamlKeys& keys) { rejection_keys(keys, config.rejection); });
    document.needs("disturbance_rejection", config.has_state_estimator(),
                   "needs an estimate of the force on the cart", "add a state_estimator");
  }
  const bool is_extended = config.state_estimator.kind == StateEstimatorKind::extended_kalman;
  if (document.decides_by_presence("friction_compensation", is_extended)) {
    document.map("friction_compensation", [&](YamlKeys& keys) { friction_keys(keys, config.friction); });
    document.needs("friction_compensation", is_extended, "needs a model of the friction",
                   "use state_estimator: {kind: extended_kalman} and a plant file with friction");
  }
}

std::string estimator_text(const EstimatorConfig& config) {
  if (config.kind == EstimatorKind::difference) return std::string("{kind: ") + difference_name + "}";
  if (config.kind == EstimatorKind::device) return std::string("{kind: ") + device_name + "}";
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

void gain_keys(YamlKeys& document, ControlConfig& config) {
  document.map("gains", [&](YamlKeys& keys) { gain_number_keys(keys, config.gains); });
  document.number("delay_s", config.delay_s, Range::within(0.0, DelayLine::longest_delay_s));
  document.number("sample_rate_hz", config.sample_rate_hz,
                  Range::within(lowest_sample_rate_hz, highest_sample_rate_hz));
  estimate_keys(document, config);
  if (!config.has_state_estimator() || document.decides_by_presence("velocity_estimator", true))
    document.map("velocity_estimator",
                 [&](YamlKeys& keys) { velocity_estimator_keys(keys, config.estimator); });
  document.usual_map("delay_compensation",
                     [&](YamlKeys& keys) { compensation_keys(keys, config.compensation); });
}

ControlConfig read_gains(const YamlMap& document) {
  ControlConfig config;
  YamlKeyReader reader(document);
  gain_keys(reader, config);
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
