// Files a user may get wrong: each is refused with exit code 2 and one sentence that gives the remedy, the
// file, the line and the key.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "command.hpp"

namespace upright::testing {
namespace {

struct Malformed {
  const char* name;    ///< letters and digits: it names the test
  std::string text;    ///< the whole file
  int line;            ///< where the mistake is
  const char* key;     ///< the word the sentence must contain: the key, or what is wrong where there is none
  const char* remedy;  ///< a part of the remedy
};

void PrintTo(const Malformed& malformed, std::ostream* out) {
  *out << malformed.name;
}

/// `text` with its only `from` made `to`.
std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos || text.find(from, at + 1) != std::string::npos)
    throw std::logic_error("'" + from + "' must stand once in the good file");
  return text.replace(at, from.size(), to);
}

const std::string plant =
    "plant:\n"
    "  cart_mass_kg: 0.815\n"
    "  pendulum:\n"
    "    mass_kg: 0.210\n"
    "    length_to_com_m: 0.305\n"
    "  gravity_mps2: 9.8\n"
    "  motor: {force_per_volt_n: 1.7189,\n"
    "          back_emf_n_per_mps: 7.682}\n"
    "  effects:\n"
    "    - {kind: viscous_friction, coefficient_n_per_mps: 3.0}\n"
    "    - {kind: stribeck_friction, extra_force_n: 0.43,\n"
    "       velocity_mps: 0.105, shape: 2.0}\n";

std::vector<Malformed> malformed_plants() {
  const std::string effects = "  effects:\n" + plant.substr(plant.find("    - {kind: visc"));
  return {
      {"empty", "", 1, "map", "key: value"},
      {"list_at_top", "- 1\n- 2\n", 1, "map", "key: value"},
      {"scalar_at_top", "plant\n", 1, "map", "key: value"},
      {"binary",
       std::string("\x7f"
                   "ELF\x02\x01\x00\x00",
                   8),
       1, "", "YAML"},
      {"zero_byte", "plant:\n  name: a" + std::string(1, '\0') + "b\n", 2, "zero byte", "plain YAML text"},
      {"zero_byte_escaped", "plant:\n  name: \"a\\0b\"\n", 2, "zero byte", "plain YAML text"},
      {"broken_yaml", "plant: {cart_mass_kg: [1,\n", 2, "", "correct the YAML"},
      {"tab_indent", "plant:\n\tcart_mass_kg: 1\n", 2, "", "correct the YAML"},
      {"two_documents", plant + "---\n" + plant, 13, "second", "keep only one YAML document"},
      {"alias", with(plant, "mass_kg: 0.210", "mass_kg: *a"), 4, "", "YAML"},
      {"plant_is_number", "plant: 3\n", 1, "plant", "map"},
      {"plant_is_list", "plant: [1, 2]\n", 1, "plant", "map"},
      {"plant_misspelt", with(plant, "plant:\n", "palnt:\n"), 1, "palnt", "plant"},
      {"second_top_key", plant + "plant_name: x\n", 13, "plant_name", "remove it"},
      {"missing_mass", with(plant, "  cart_mass_kg: 0.815\n", ""), 2, "cart_mass_kg", "add cart_mass_kg"},
      {"missing_gravity", with(plant, "  gravity_mps2: 9.8\n", ""), 2, "gravity_mps2", "add"},
      {"missing_effects", plant.substr(0, plant.find("  effects")), 2, "effects", "add"},
      {"misspelt_key", with(plant, "gravity_mps2", "gravity_mp2"), 6, "gravity_mp2", "gravity_mps2"},
      {"unknown_key", with(plant, "  gravity", "  colour: red\n  gravity"), 6, "colour", "remove it"},
      {"doubled_key", with(plant, "  gravity", "  cart_mass_kg: 1.0\n  gravity"), 6, "cart_mass_kg",
       "keep one"},
      {"mass_is_word", with(plant, "0.815", "heavy"), 2, "cart_mass_kg", "a number above 0"},
      {"mass_is_quoted", with(plant, "0.815", "'0.815'"), 2, "cart_mass_kg", "number"},
      {"mass_has_unit", with(plant, "0.815", "0.815 kg"), 2, "cart_mass_kg", "number"},
      {"mass_decimal_comma", with(plant, "0.815", "0,815"), 2, "cart_mass_kg", "number"},
      {"mass_hexadecimal", with(plant, "0.815", "0x1p3"), 2, "cart_mass_kg", "number"},
      {"mass_is_list", with(plant, "0.815", "[0.815]"), 2, "cart_mass_kg", "number"},
      {"mass_empty", with(plant, "0.815", ""), 2, "cart_mass_kg", "number"},
      {"mass_null", with(plant, "0.815", "~"), 2, "cart_mass_kg", "number"},
      {"mass_true", with(plant, "0.815", "true"), 2, "cart_mass_kg", "number"},
      {"mass_nan", with(plant, "0.815", ".nan"), 2, "cart_mass_kg", "number"},
      {"mass_plain_nan", with(plant, "0.815", "nan"), 2, "cart_mass_kg", "number"},
      {"mass_infinite", with(plant, "0.815", ".inf"), 2, "cart_mass_kg", "number"},
      {"mass_overflows", with(plant, "0.815", "1e999"), 2, "cart_mass_kg", "number"},
      {"mass_zero", with(plant, "0.815", "0.0"), 2, "cart_mass_kg", "above 0"},
      {"mass_negative", with(plant, "0.815", "-0.815"), 2, "cart_mass_kg", "above 0"},
      {"gravity_negative", with(plant, "9.8", "-9.8"), 6, "gravity_mps2", "not below 0"},
      {"pendulum_is_number", "plant:\n  cart_mass_kg: 1\n  pendulum: 0.2\n", 3, "pendulum", "map"},
      {"pendulum_without_length", with(plant, "    length_to_com_m: 0.305\n", ""), 4, "length_to_com_m",
       "add"},
      {"pendulum_length_zero", with(plant, "0.305", "0"), 5, "length_to_com_m", "above 0"},
      {"pendulum_unknown_key",
       with(plant, "length_to_com_m: 0.305", "length_to_com_m: 0.305\n    length_to_con_m: 1"), 6,
       "length_to_con_m", "length_to_com_m"},
      {"inertia_too_small",
       with(plant, "length_to_com_m: 0.305", "length_to_com_m: 0.305\n    inertia_about_pivot_kgm2: 1e-6"), 6,
       "inertia_about_pivot_kgm2", "at least"},
      {"motor_is_text",
       with(plant, "{force_per_volt_n: 1.7189,\n          back_emf_n_per_mps: 7.682}", "strong"), 7, "motor",
       "map"},
      {"motor_back_emf_negative", with(plant, "7.682", "-7.682"), 8, "back_emf_n_per_mps", "not below 0"},
      {"motor_key_unknown", with(plant, "back_emf_n_per_mps: 7.682", "back_emf_n_per_mps: 7.682, kt: 1"), 8,
       "kt", "remove it"},
      {"effects_is_map", with(plant, effects, "  effects: {kind: viscous_friction}\n"), 9, "effects", "list"},
      {"effects_is_null", with(plant, effects, "  effects:\n"), 9, "effects", "list"},
      {"effect_is_word", with(plant, effects, "  effects: [viscous_friction]\n"), 9, "effects[0]",
       "{key: value}"},
      {"effect_kind_misspelt", with(plant, "viscous_friction,", "viscus_friction,"), 10, "kind",
       "viscous_friction"},
      {"effect_without_kind", with(plant, "kind: viscous_friction, ", ""), 10, "kind", "one of"},
      {"effect_kind_is_list", with(plant, "viscous_friction,", "[a],"), 10, "kind", "one of"},
      {"effect_parameter_missing", with(plant, ", coefficient_n_per_mps: 3.0", ""), 10,
       "coefficient_n_per_mps", "add"},
      {"effect_parameter_unknown", with(plant, "_n_per_mps: 3.0", "_n_per_mps: 3.0, coeff: 2"), 10, "coeff",
       "remove"},
      {"effect_parameter_negative", with(plant, "3.0", "-3.0"), 10, "coefficient_n_per_mps", "not below 0"},
      {"effect_parameter_nan", with(plant, "3.0", ".NaN"), 10, "coefficient_n_per_mps", "number"},
      {"effect_shape_out_of_range", with(plant, "2.0", "20.0"), 12, "shape", "from 0.1 to 10"},
      {"effect_velocity_zero", with(plant, "0.105", "0.0"), 12, "velocity_mps", "above 0"},
      {"effect_twice", plant + "    - {kind: viscous_friction, coefficient_n_per_mps: 1.0}\n", 13, "kind",
       "keep one viscous_friction"},
      {"bristles_without_level",
       with(plant, effects,
            "  effects:\n    - {kind: bristle_friction, stiffness_n_per_m: 121, damping_n_per_mps: 70}\n"),
       9, "effects", "coulomb_friction"},
      {"key_is_list", with(plant, "  gravity", "  [a, b]: 1\n  gravity"), 6, "key", "plain words"},
      {"deep_nesting", "plant: " + std::string(5000, '[') + "\n", 1, "levels", "less deeply"},
  };
}

const std::string gains =
    "gains:\n"
    "  cart_position_v_per_m: 70.7107\n"
    "  pendulum_angle_v_per_rad: 304.9273\n"
    "  cart_velocity_v_per_mps: 143.3152\n"
    "  pendulum_rate_v_per_radps: 61.0833\n"
    "delay_s: 0.0\n"
    "sample_rate_hz: 1000\n"
    "velocity_estimator:\n"
    "  kind: second_order_filter\n"
    "  cutoff_hz: 50\n"
    "  damping: 0.9\n"
    "delay_compensation:\n"
    "  kind: none\n";

std::vector<Malformed> malformed_gains() {
  const std::string predictor = with(gains, "kind: none", "kind: predictor");
  return {
      {"gains_missing_number", with(gains, "  cart_position_v_per_m: 70.7107\n", ""), 2,
       "cart_position_v_per_m", "add"},
      {"gains_misspelt", with(gains, "gains:\n", "gain:\n"), 1, "gain", "did you mean gains?"},
      {"gains_is_list", "gains: [1, 2, 3, 4]\ndelay_s: 0\n", 1, "gains", "map"},
      {"gains_unknown_key", with(gains, "delay_s: 0.0", "  integral: 1\ndelay_s: 0.0"), 6, "integral",
       "remove it"},
      {"gain_is_text", with(gains, "70.7107", "lots"), 2, "cart_position_v_per_m", "number"},
      {"gain_is_nan", with(gains, "304.9273", ".nan"), 3, "pendulum_angle_v_per_rad", "number"},
      {"gain_is_infinite", with(gains, "61.0833", "-.inf"), 5, "pendulum_rate_v_per_radps", "number"},
      {"delay_missing", with(gains, "delay_s: 0.0\n", ""), 1, "delay_s", "add"},
      {"delay_negative", with(gains, "delay_s: 0.0", "delay_s: -0.01"), 6, "delay_s", "from 0"},
      {"delay_too_long", with(gains, "delay_s: 0.0", "delay_s: 1e6"), 6, "delay_s", "from 0"},
      {"delay_in_text", with(gains, "delay_s: 0.0", "delay_s: 10ms"), 6, "delay_s", "number"},
      {"delay_misspelt", with(gains, "delay_s: 0.0", "delay: 0.0"), 6, "delay", "delay_s"},
      {"rate_zero", with(gains, "1000", "0"), 7, "sample_rate_hz", "from 1"},
      {"rate_negative", with(gains, "1000", "-1000"), 7, "sample_rate_hz", "from 1"},
      {"rate_too_high", with(gains, "1000", "1e9"), 7, "sample_rate_hz", "to 20000"},
      {"rate_missing", with(gains, "sample_rate_hz: 1000\n", ""), 1, "sample_rate_hz", "add"},
      {"estimator_missing", gains.substr(0, gains.find("velocity_estimator")), 1, "velocity_estimator",
       "add"},
      {"estimator_kind_unknown", with(gains, "second_order_filter", "kalman"), 9, "kind",
       "second_order_filter"},
      {"estimator_kind_misspelt", with(gains, "second_order_filter", "second_order_fliter"), 9, "kind",
       "did you mean second_order_filter?"},
      {"estimator_is_word",
       with(gains, "\n  kind: second_order_filter\n  cutoff_hz: 50\n  damping: 0.9", " fast"), 8,
       "velocity_estimator", "map"},
      {"cutoff_missing", with(gains, "  cutoff_hz: 50\n", ""), 9, "cutoff_hz", "add"},
      {"cutoff_zero", with(gains, "cutoff_hz: 50", "cutoff_hz: 0"), 10, "cutoff_hz", "above 0"},
      {"damping_negative", with(gains, "0.9", "-0.9"), 11, "damping", "above 0"},
      {"difference_with_cutoff", with(gains, "second_order_filter", "difference"), 10, "cutoff_hz",
       "remove it"},
      {"compensation_kind_unknown", with(gains, "kind: none", "kind: smith"), 13, "kind", "predictor"},
      {"compensation_without_plant", predictor, 13, "plant", "add plant"},
      {"compensation_plant_is_map", predictor + "  plant: {a: 1}\n", 14, "plant", "text"},
      {"none_with_plant", gains + "  plant: x.yaml\n", 14, "plant", "remove it"},
      {"gains_unknown_top_key", gains + "author: me\n", 14, "author", "remove it"},
      {"gains_doubled_key", gains + "delay_s: 0.1\n", 14, "delay_s", "keep one"},
  };
}

const std::string rig_head =
    "calibration:\n"
    "  cart: {m_per_count: 2.27485e-5, sign: 1, width_bits: 32, fastest_mps: 5.0}\n"
    "  pendulum: {counts_per_revolution: 4096, sign: -1, width_bits: 24, fastest_radps: 60.0}\n"
    "  zero: {at: counts, cart_counts: 0, pendulum_counts: 0, pose: upright}\n"
    "amplifier: {limit_v: 15.0, sign: 1}\n"
    "track: {limit_m: 0.4}\n"
    "fall_angle_rad: 0.6\n"
    "watchdog_s: 0.1\n";

const std::string simulated_rig = "backend: simulated\n" + rig_head +
                                  "simulated:\n"
                                  "  plant: " UPRIGHT_SOURCE_DIR
                                  "/config/plants/viscous.yaml\n"
                                  "  initial: {cart_m: 0.0, theta_rad: 0.05}\n"
                                  "  quantise: true\n"
                                  "  noise: {cart_m: 0.0, theta_rad: 1e-5}\n"
                                  "  timing_jitter_s: 0.0\n";

const std::string modbus_rig =
    "backend: modbus-tcp\n" + rig_head +
    "modbus:\n"
    "  host: 127.0.0.1\n"
    "  port: 1502\n"
    "  unit: 1\n"
    "  response_timeout_s: 0.0008\n"
    "  exchange: read_write\n"
    "  counters: {table: holding, cart_address: 0, pendulum_address: 2, registers: 2, "
    "word_order: high_first}\n"
    "  boot_count_address: 4\n"
    "  voltage: {address: 16, encoding: int16, counts_per_v: 1000.0}\n"
    "  enable_address: 17\n"
    "  device_watchdog: {address: 18, time_s: 0.12, seconds_per_count: 0.001}\n";

const std::string serial_rig =
    with(with(modbus_rig, "modbus-tcp", "modbus-rtu"), "  host: 127.0.0.1\n  port: 1502\n",
         "  device: /dev/ttyUSB0\n  baud: 921600\n  parity: none\n  stop_bits: 1\n");

const std::string comedi_rig =
    "backend: comedi\n" + rig_head +
    "comedi:\n"
    "  device: /dev/comedi0\n"
    "  cart: {kind: analog_input, subdevice: 0, channel: 0, range_v: [-10, 10], counts_per_v: 1000}\n"
    "  pendulum: {kind: counter, subdevice: 4, channel: 1, lines: {a: 3, b: 11}}\n"
    "  output: {subdevice: 1, channel: 0, range_v: [-5, 5], amplifier_gain: 3}\n";

const std::string quanser_rig = "backend: quanser-hil\n" + rig_head +
                                "quanser_hil:\n"
                                "  board_type: q2_usb\n"
                                "  encoder_channels: {cart: 0, pendulum: 1}\n"
                                "  analog_output_channel: 0\n"
                                "  amplifier_gain: 3\n"
                                "  watchdog_s: 0.05\n";

const std::string rig_with_lines = simulated_rig +
                                   "gpio:\n"
                                   "  chip: gpiochip0\n"
                                   "  emergency_stop: {line: 4, active: high, bias: pull_up}\n"
                                   "  limit_switches:\n"
                                   "    - {end: plus_x, line: 5, active: high}\n"
                                   "    - {end: minus_x, line: 6, active: high}\n"
                                   "  amplifier_enable: {line: 17, active: low}\n"
                                   "  heartbeat: {line: 18}\n";

const std::string rig_with_line_encoder =
    with(with(modbus_rig, "backend: modbus-tcp",
              "backend: {cart_encoder: modbus-tcp, pendulum_encoder: gpio, output: modbus-tcp}"),
         "pendulum_address: 2, ", "") +
    "gpio:\n"
    "  chip: /dev/gpiochip0\n"
    "  pendulum_encoder: {a: 22, b: 23, fastest_edges_per_s: 8000}\n";

std::vector<Malformed> malformed_lines() {
  const std::string& lines = rig_with_lines;
  const std::string& encoder = rig_with_line_encoder;
  return {
      {"chip_missing", with(lines, "  chip: gpiochip0\n", ""), 17, "chip", "add chip"},
      {"chip_is_list", with(lines, "gpiochip0", "[0]"), 17, "chip", "text"},
      {"stop_without_line", with(lines, "line: 4, ", ""), 18, "line", "add line"},
      {"line_negative", with(lines, "line: 4", "line: -4"), 18, "line", "from 0"},
      {"line_in_text", with(lines, "line: 4", "line: GPIO4"), 18, "line", "number"},
      {"line_used_twice", with(lines, "line: 6", "line: 5"), 21, "line", "different line for each"},
      {"active_missing", with(lines, "line: 4, active: high", "line: 4"), 18, "active", "add active"},
      {"active_unknown", with(lines, "active: low", "active: closed"), 22, "active", "high"},
      {"bias_unknown", with(lines, "pull_up", "pullup"), 18, "bias", "did you mean pull_up?"},
      {"end_unknown", with(lines, "plus_x", "left"), 20, "end", "minus_x"},
      {"switches_are_a_map", with(lines, "    - {end: plus_x, line: 5, active: high}\n    - {", "    x: {"),
       19, "limit_switches", "list"},
      {"heartbeat_is_number", with(lines, "heartbeat: {line: 18}", "heartbeat: 18"), 23, "heartbeat", "map"},
      {"lines_unknown_key", lines + "  emergancy: {line: 9, active: low}\n", 24, "emergancy", "remove it"},
      {"lines_encoder_not_in_use", lines + "  cart_encoder: {a: 1, b: 2, fastest_edges_per_s: 5000}\n", 24,
       "cart_encoder", "remove cart_encoder"},
      {"encoder_missing",
       with(encoder, "  pendulum_encoder: {a: 22, b: 23, fastest_edges_per_s: 8000}\n",
            "  heartbeat: {line: 1}\n"),
       22, "pendulum_encoder", "add pendulum_encoder"},
      {"encoder_on_one_line", with(encoder, "b: 23", "b: 22"), 23, "b", "different line for each"},
      {"edges_too_fast", with(encoder, "8000", "44000"), 23, "fastest_edges_per_s", "20000"},
      {"edges_in_text", with(encoder, "8000", "fast"), 23, "fastest_edges_per_s", "number"},
      {"gpio_as_output",
       with(with(encoder, "output: modbus-tcp", "output: gpio"),
            "  voltage: {address: 16, encoding: int16, counts_per_v: 1000.0}\n  enable_address: 17\n  "
            "device_watchdog: {address: 18, time_s: 0.12, seconds_per_count: 0.001}\n",
            "  voltage: {address: 16, encoding: int16, counts_per_v: 1000.0}\n"),
       1, "backend", "another backend"},
  };
}

std::vector<Malformed> malformed_rigs() {
  const std::string& comedi = comedi_rig;
  const std::string& quanser = quanser_rig;
  const std::string& sim = simulated_rig;
  const std::string& tcp = modbus_rig;
  const std::string& rtu = serial_rig;
  return {
      {"backend_unknown", with(sim, "backend: simulated", "backend: usb"), 1, "backend", "one of"},
      {"backend_misspelt", with(tcp, "modbus-tcp", "modbus-tpc"), 1, "backend", "did you mean modbus-tcp?"},
      {"backend_key_misspelt", with(sim, "backend", "backand"), 1, "backand", "did you mean backend?"},
      {"backend_pair_without_output", with(sim, "backend: simulated", "backend: {encoders: simulated}"), 1,
       "output", "add output"},
      {"backends_do_not_go_together",
       with(tcp, "backend: modbus-tcp", "backend: {encoders: modbus-tcp, output: modbus-rtu}"), 1, "backend",
       "use either"},
      {"calibration_missing", with(sim, "calibration:", "calibratoin:"), 2, "calibratoin", "calibration"},
      {"cart_scale_zero", with(sim, "2.27485e-5", "0"), 3, "m_per_count", "number"},
      {"cart_scale_negative", with(sim, "2.27485e-5", "-2.27485e-5"), 3, "m_per_count", "number"},
      {"cart_scale_nan", with(sim, "2.27485e-5", ".nan"), 3, "m_per_count", "number"},
      {"cart_scale_missing", with(sim, "m_per_count: 2.27485e-5, ", ""), 3, "m_per_count", "add"},
      {"cart_sign_zero", with(sim, "sign: 1, width_bits: 32", "sign: 0, width_bits: 32"), 3, "sign",
       "1 or -1"},
      {"cart_sign_word", with(sim, "sign: 1, width_bits: 32", "sign: plus, width_bits: 32"), 3, "sign",
       "number"},
      {"cart_sign_two", with(sim, "sign: 1, width_bits: 32", "sign: 2, width_bits: 32"), 3, "sign",
       "from -1 to 1"},
      {"counter_width_odd", with(sim, "width_bits: 24", "width_bits: 24.5"), 4, "width_bits", "whole number"},
      {"counter_width_too_wide", with(sim, "width_bits: 24", "width_bits: 64"), 4, "width_bits", "to 32"},
      {"revolution_negative", with(sim, "4096", "-4096"), 4, "counts_per_revolution", "number"},
      {"zero_pose_unknown", with(sim, "pose: upright", "pose: lying"), 5, "pose", "hanging"},
      {"zero_counts_missing", with(sim, "cart_counts: 0, ", ""), 5, "cart_counts", "add"},
      {"zero_counts_too_large", with(sim, "pendulum_counts: 0", "pendulum_counts: 99999999"), 5,
       "pendulum_counts", "whole number"},
      {"amplifier_limit_zero", with(sim, "15.0", "0"), 6, "limit_v", "above 0"},
      {"amplifier_limit_infinite", with(sim, "15.0", ".inf"), 6, "limit_v", "number"},
      {"track_limit_negative", with(sim, "limit_m: 0.4", "limit_m: -0.4"), 7, "limit_m", "above 0"},
      {"fall_angle_in_degrees", with(sim, "fall_angle_rad: 0.6", "fall_angle_rad: 30"), 8, "fall_angle_rad",
       "number"},
      {"fall_angle_unit", with(sim, "fall_angle_rad", "fall_angle_deg"), 8, "fall_angle_deg",
       "fall_angle_rad"},
      {"watchdog_zero", with(sim, "watchdog_s: 0.1", "watchdog_s: 0"), 9, "watchdog_s", "above 0"},
      {"watchdog_missing", with(sim, "watchdog_s: 0.1\n", ""), 1, "watchdog_s", "add"},
      {"simulated_section_missing", sim.substr(0, sim.find("simulated:\n")), 1, "simulated", "add simulated"},
      {"simulated_without_plant",
       with(sim, "  plant: " UPRIGHT_SOURCE_DIR "/config/plants/viscous.yaml\n", ""), 11, "plant",
       "add plant"},
      {"simulated_noise_negative", with(sim, "1e-5", "-1e-5"), 14, "theta_rad", "from 0"},
      {"simulated_quantise_yes", with(sim, "quantise: true", "quantise: yes"), 13, "quantise",
       "true or false"},
      {"simulated_unknown_key", sim + "  speed: 2\n", 16, "speed", "remove it"},
      {"modbus_section_missing", tcp.substr(0, tcp.find("modbus:\n")), 1, "modbus", "add modbus"},
      {"host_missing", with(tcp, "  host: 127.0.0.1\n", ""), 11, "host", "add host"},
      {"port_zero", with(tcp, "1502", "0"), 12, "port", "from 1 to 65535"},
      {"port_too_high", with(tcp, "1502", "70000"), 12, "port", "from 1 to 65535"},
      {"unit_too_high", with(tcp, "unit: 1\n", "unit: 300\n"), 13, "unit", "from 0"},
      {"timeout_zero", with(tcp, "0.0008", "0"), 14, "response_timeout_s", "number"},
      {"timeout_beyond_watchdog", with(tcp, "0.0008", "0.5"), 14, "response_timeout_s", "less"},
      {"exchange_unknown", with(tcp, "exchange: read_write", "exchange: 0x17"), 15, "exchange", "read_write"},
      {"exchange_of_input_registers", with(tcp, "table: holding", "table: input"), 15, "exchange",
       "separate"},
      {"table_unknown", with(tcp, "table: holding", "table: coils"), 16, "table", "holding"},
      {"address_negative", with(tcp, "cart_address: 0", "cart_address: -1"), 16, "cart_address", "from 0"},
      {"address_beyond_the_last", with(tcp, "pendulum_address: 2", "pendulum_address: 70000"), 16,
       "pendulum_address", "to 65535"},
      {"counter_ends_beyond_the_last", with(tcp, "pendulum_address: 2", "pendulum_address: 65535"), 16,
       "counters", "lower"},
      {"counters_overlap", with(tcp, "pendulum_address: 2", "pendulum_address: 1"), 16, "counters",
       "different registers for each"},
      {"counters_too_far_apart", with(tcp, "pendulum_address: 2", "pendulum_address: 2000"), 16, "counters",
       "125"},
      {"registers_too_few_for_width", with(tcp, "registers: 2, ", "registers: 1, "), 16, "registers", "2"},
      {"word_order_unknown", with(tcp, "high_first", "little"), 16, "word_order", "low_first"},
      {"voltage_encoding_unknown", with(tcp, "int16", "double"), 18, "encoding", "float32"},
      {"voltage_scale_negative", with(tcp, "1000.0", "-1000.0"), 18, "counts_per_v", "number"},
      {"voltage_does_not_fit", with(tcp, "1000.0", "5000.0"), 18, "counts_per_v", "at most"},
      {"voltage_on_a_counter", with(tcp, "address: 16", "address: 2"), 18, "voltage",
       "different registers for each"},
      {"device_watchdog_zero", with(tcp, "time_s: 0.12", "time_s: 0"), 20, "time_s", "above 0"},
      {"device_watchdog_does_not_fit", with(tcp, "seconds_per_count: 0.001", "seconds_per_count: 1e-6"), 20,
       "time_s", "65535"},
      {"serial_without_device", with(rtu, "  device: /dev/ttyUSB0\n", ""), 11, "device", "add device"},
      {"serial_with_host", rtu + "  host: 127.0.0.1\n", 23, "host", "remove it"},
      {"baud_unknown", with(rtu, "921600", "920000"), 12, "baud", "standard rate"},
      {"baud_is_text", with(rtu, "921600", "fast"), 12, "baud", "number"},
      {"parity_unknown", with(rtu, "parity: none", "parity: N"), 13, "parity", "even"},
      {"stop_bits_three", with(rtu, "stop_bits: 1", "stop_bits: 3"), 14, "stop_bits", "from 1 to 2"},
      {"half_simulated", with(comedi, "backend: comedi", "backend: {encoders: comedi, output: simulated}"), 1,
       "backend", "simulated for all parts or for none"},
      {"backend_of_one_encoder",
       with(comedi, "backend: comedi", "backend: {cart_encoder: comedi, output: comedi}"), 1,
       "pendulum_encoder", "add pendulum_encoder"},
      {"comedi_section_missing", comedi.substr(0, comedi.find("comedi:\n")) + "comedy:\n  a: 1\n", 10,
       "comedy", "did you mean comedi?"},
      {"comedi_without_device", with(comedi, "  device: /dev/comedi0\n", ""), 11, "device", "add device"},
      {"comedi_kind_misspelt", with(comedi, "analog_input", "analog_imput"), 12, "kind",
       "did you mean analog_input?"},
      {"comedi_subdevice_negative", with(comedi, "subdevice: 4", "subdevice: -4"), 13, "subdevice", "from 0"},
      {"comedi_range_of_one_end", with(comedi, "[-5, 5]", "[-5]"), 14, "range_v", "upper end"},
      {"comedi_range_of_one_sign", with(comedi, "[-5, 5]", "[0, 5]"), 14, "range_v",
       "does not contain zero volts"},
      {"comedi_range_too_small", with(comedi, "amplifier_gain: 3", "amplifier_gain: 2"), 14, "range_v",
       "limit_v to at most 10"},
      {"comedi_gain_missing", with(comedi, ", amplifier_gain: 3", ""), 14, "amplifier_gain", "add"},
      {"comedi_lines_the_same", with(comedi, "b: 11", "b: 3"), 13, "b", "a different line for each"},
      {"comedi_scale_zero", with(comedi, "counts_per_v: 1000", "counts_per_v: 0"), 12, "counts_per_v",
       "number"},
      {"comedi_range_of_a_counter", with(comedi, "lines: {a: 3, b: 11}", "range_v: [-5, 5]"), 13, "range_v",
       "remove it"},
      {"quanser_section_misspelt", with(quanser, "quanser_hil:", "quanser:"), 1, "quanser_hil",
       "add quanser_hil"},
      {"quanser_without_board", with(quanser, "  board_type: q2_usb\n", ""), 11, "board_type", "add"},
      {"quanser_channel_not_there", with(quanser, "pendulum: 1}", "pendulum: 2}"), 12, "pendulum", "0 to 1"},
      {"quanser_channel_twice", with(quanser, "pendulum: 1}", "pendulum: 0}"), 12, "pendulum",
       "different channel for each"},
      {"quanser_output_not_there", with(quanser, "output_channel: 0", "output_channel: 2"), 13,
       "analog_output_channel", "0 to 1"},
      {"quanser_range_too_small", with(quanser, "amplifier_gain: 3", "output_range_v: [-5, 5]"), 14,
       "output_range_v", "limit_v to at most 5"},
      {"quanser_range_of_one_sign", with(quanser, "amplifier_gain: 3", "output_range_v: [0, 10]"), 14,
       "output_range_v", "lower and the upper end"},
      {"quanser_watchdog_too_long", with(quanser, "0.05\n", "9\n"), 15, "watchdog_s", "to 8.1"},
      {"quanser_watchdog_zero", with(quanser, "  watchdog_s: 0.05", "  watchdog_s: 0"), 15, "watchdog_s",
       "number"},
      {"rig_second_document", sim + "---\nbackend: simulated\n", 16, "second", "keep only one"},
  };
}

class MalformedFile : public ::testing::TestWithParam<Malformed> {};

TEST_P(MalformedFile, IsRefusedWithRemedyFileLineAndKey) {
  const Malformed& malformed = GetParam();
  const TemporaryFolder folder;
  const std::string file = folder.write(std::string(malformed.name) + ".yaml", malformed.text).string();
  const CommandResult result = run_upright("check " + shell_quoted(file));
  const std::string where = file + ":" + std::to_string(malformed.line) + ":";
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  const std::size_t at = result.err.find(where);
  ASSERT_NE(at, std::string::npos) << "expected " << where << "\n" << result.err;
  // The cause comes first: file, line and key, and then the remedy.
  const std::size_t remedy = result.err.rfind(malformed.remedy);
  ASSERT_NE(remedy, std::string::npos) << result.err;
  EXPECT_GT(remedy, at) << result.err;
  EXPECT_NE(result.err.find(malformed.key, at), std::string::npos) << result.err;
}

std::string name_of_test(const ::testing::TestParamInfo<Malformed>& info) {
  return info.param.name;
}

INSTANTIATE_TEST_SUITE_P(Plant, MalformedFile, ::testing::ValuesIn(malformed_plants()), name_of_test);

INSTANTIATE_TEST_SUITE_P(Gains, MalformedFile, ::testing::ValuesIn(malformed_gains()), name_of_test);

INSTANTIATE_TEST_SUITE_P(Rig, MalformedFile, ::testing::ValuesIn(malformed_rigs()), name_of_test);

INSTANTIATE_TEST_SUITE_P(Lines, MalformedFile, ::testing::ValuesIn(malformed_lines()), name_of_test);

TEST(WellFormedFile, IsAccepted) {
  const TemporaryFolder folder;
  for (const auto& [name, text] : {std::pair{"plant.yaml", plant},
                                   {"gains.yaml", gains},
                                   {"sim.yaml", simulated_rig},
                                   {"tcp.yaml", modbus_rig},
                                   {"rtu.yaml", serial_rig},
                                   {"lines.yaml", rig_with_lines},
                                   {"line_encoder.yaml", rig_with_line_encoder}}) {
    const CommandResult result = run_upright("check " + folder.write(name, text).string());
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
}

TEST(ReferencedFile, IsCheckedToo) {
  const TemporaryFolder folder;
  const std::string file =
      folder.write("gains.yaml", with(gains, "kind: none", "kind: predictor\n  plant: there/is/none.yaml"));
  const CommandResult result = run_upright("check " + file);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find((folder.path() / "there/is/none.yaml").string()), std::string::npos)
      << result.err;
}

}  // namespace
}  // namespace upright::testing
