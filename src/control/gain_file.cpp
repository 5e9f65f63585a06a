#include "upright/control/gain_file.hpp"

#include <fstream>

#include "upright/control/delay_line.hpp"
#include "upright/model/error.hpp"

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

}  // namespace

ControlConfig read_gains(const YamlMap& document) {
  ControlConfig config;
  config.gains = read_gain_numbers(document.map("gains"));
  config.delay_s = document.number("delay_s", Range::within(0.0, DelayLine::longest_delay_s));
  config.sample_rate_hz =
      document.number("sample_rate_hz", Range::within(lowest_sample_rate_hz, highest_sample_rate_hz));
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
  if (config.compensation.kind == CompensationKind::predictor)
    text +=
        "delay_compensation: {kind: predictor, plant: " + quoted(config.compensation.plant.string()) + "}\n";
  else
    text += "delay_compensation: {kind: none}\n";
  return text;
}

void write_gain_file(const ControlConfig& config, const std::filesystem::path& file,
                     const std::vector<std::string>& comments) {
  std::ofstream out(file);
  out << gain_text(config, comments);
  out.close();
  if (!out)
    throw Error(ExitCode::usage, "check the folder and its free space: cannot write " + file.string());
}

}  // namespace upright
