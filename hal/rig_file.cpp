#include "upright/hal/rig_file.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "backends.hpp"
#include "gpio/gpio_section.hpp"
#include "simulated/simulated_section.hpp"
#include "upright/base/error.hpp"
#include "yaml_words.hpp"

namespace upright {

namespace {

constexpr int finer_without_quantisation = 1024;
constexpr double longest_spin_us = 1e4;  // the loop also keeps it below half a period

constexpr Words<2> poses = {"upright", "hanging"};
constexpr Words<2> zeros = {"counts", "start"};

int read_sign(const YamlMap& map) {
  const int sign = small_integer(map, "sign", -1, 1);
  if (sign == 0) map.fail("sign", "is 0", "give sign 1 or -1");
  return sign;
}

EncoderCalibration read_encoder(const YamlMap& map, bool is_cart) {
  EncoderCalibration encoder;
  encoder.per_count = is_cart ? map.number("m_per_count", Range{1e-9, 1e-2})
                              : 2.0 * std::numbers::pi / map.number("counts_per_revolution", Range{16, 1e8});
  encoder.sign = read_sign(map);
  encoder.width_bits = small_integer(map, "width_bits", 8, 32);
  encoder.fastest_per_s = map.number(is_cart ? "fastest_mps" : "fastest_radps", Range{1e-3, 1e4});
  map.finish();
  return encoder;
}

Calibration read_calibration(const YamlMap& map) {
  Calibration calibration;
  calibration.cart = read_encoder(map.map("cart"), true);
  calibration.pendulum = read_encoder(map.map("pendulum"), false);
  const YamlMap zero = map.map("zero");
  calibration.zero_at_start = choose<int>(zero, "at", zeros) == 1;
  if (!calibration.zero_at_start) {
    const auto counts = [&](const char* key, int width_bits) {
      return zero.integer(key, -(std::int64_t{1} << (width_bits - 1)), (std::int64_t{1} << width_bits) - 1);
    };
    calibration.cart_zero_counts = counts("cart_counts", calibration.cart.width_bits);
    calibration.pendulum_zero_counts = counts("pendulum_counts", calibration.pendulum.width_bits);
  }
  calibration.zero_pose = choose<ZeroPose>(zero, "pose", poses);
  zero.finish();
  map.finish();
  return calibration;
}

Backend choose_backend(const YamlMap& map, const std::string& key) {
  std::vector<std::string> names;
  for (DescribeBackend* describe : all_backends) names.emplace_back(describe().name);
  const std::string name = map.choice(key, names);
  return static_cast<Backend>(std::find(names.begin(), names.end(), name) - names.begin());
}

void read_backends(const YamlMap& document, RigFile& rig) {
  if (!document.is_map("backend")) {
    rig.cart_encoder = rig.pendulum_encoder = rig.output = choose_backend(document, "backend");
    return;
  }
  const YamlMap map = document.map("backend");
  if (map.has("cart_encoder") || map.has("pendulum_encoder")) {
    rig.cart_encoder = choose_backend(map, "cart_encoder");
    rig.pendulum_encoder = choose_backend(map, "pendulum_encoder");
  } else {
    rig.cart_encoder = rig.pendulum_encoder = choose_backend(map, "encoders");
  }
  rig.output = choose_backend(map, "output");
  map.finish();
  const RigRoles simulated = roles_of(rig, Backend::simulated);
  if (simulated.any() && !simulated.all())
    document.fail("backend",
                  "joins simulated to hardware, but a simulated plant moves by its own output only",
                  "use simulated for all of it or for none");
}

bool uses(const RigFile& rig, Backend backend) {
  return roles_of(rig, backend).any();
}

/// The section `gpio` has the encoders that the rig takes from it, and no others.
void check_gpio_roles(const YamlMap& document, const RigFile& rig) {
  const RigRoles roles = roles_of(rig, Backend::gpio);
  if (roles.output)
    document.fail("backend", "gives the output to gpio, whose lines cannot carry a voltage",
                  "name another backend as output");
  if (!rig.gpio) return;
  const YamlMap section = document.map("gpio");
  const auto match = [&](const char* key, bool is_wanted, bool is_there) {
    if (is_wanted && !is_there)
      section.fail(key, "is missing, though backend takes its counts from gpio",
                   std::string("add ") + key + " (its lines a and b)");
    if (!is_wanted && is_there)
      section.fail(key, "is not in use, since backend takes its counts from elsewhere",
                   std::string("remove ") + key + ", or name gpio as its backend");
  };
  match("cart_encoder", roles.cart, rig.gpio->cart_encoder.has_value());
  match("pendulum_encoder", roles.pendulum, rig.gpio->pendulum_encoder.has_value());
}

std::string backend_line(const RigFile& rig) {
  const std::string cart = backend_name(rig.cart_encoder), pendulum = backend_name(rig.pendulum_encoder);
  const std::string output = backend_name(rig.output);
  if (cart != pendulum)
    return "backend: {cart_encoder: " + cart + ", pendulum_encoder: " + pendulum + ", output: " + output +
           "}\n";
  if (cart != output) return "backend: {encoders: " + cart + ", output: " + output + "}\n";
  return "backend: " + output + "\n";
}

std::string zero_text(const Calibration& calibration) {
  std::string text = "{at: ";
  if (calibration.zero_at_start)
    text += "start";
  else
    text += "counts, cart_counts: " + std::to_string(calibration.cart_zero_counts) +
            ", pendulum_counts: " + std::to_string(calibration.pendulum_zero_counts);
  return text + ", pose: " + word_of(calibration.zero_pose, poses) + "}";
}

/// Counts per revolution whose reader gives the same radians per count, bit for bit.
std::string counts_per_revolution_text(double rad_per_count) {
  const double turn = 2.0 * std::numbers::pi;
  const double near = turn / rad_per_count;
  if (turn / std::nearbyint(near) == rad_per_count) return exact_text(std::nearbyint(near));
  double low = near, high = near;
  for (int i = 0; i < 16; ++i) {
    if (turn / low == rad_per_count) return exact_text(low);
    if (turn / high == rad_per_count) return exact_text(high);
    low = std::nextafter(low, 0.0);
    high = std::nextafter(high, 2.0 * high);
  }
  return exact_text(near);
}

std::string calibration_text(const Calibration& calibration) {
  const EncoderCalibration& cart = calibration.cart;
  const EncoderCalibration& pendulum = calibration.pendulum;
  return "calibration:\n  cart: {m_per_count: " + exact_text(cart.per_count) +
         ", sign: " + std::to_string(cart.sign) + ", width_bits: " + std::to_string(cart.width_bits) +
         ", fastest_mps: " + exact_text(cart.fastest_per_s) +
         "}\n  pendulum: {counts_per_revolution: " + counts_per_revolution_text(pendulum.per_count) +
         ", sign: " + std::to_string(pendulum.sign) + ", width_bits: " + std::to_string(pendulum.width_bits) +
         ", fastest_radps: " + exact_text(pendulum.fastest_per_s) + "}\n  zero: " + zero_text(calibration) +
         "\n";
}

}  // namespace

std::string backend_name(Backend backend) {
  return all_backends.at(static_cast<std::size_t>(backend))().name;
}

RigRoles roles_of(const RigFile& rig, Backend backend) {
  return {rig.cart_encoder == backend, rig.pendulum_encoder == backend, rig.output == backend};
}

bool is_simulated(const RigFile& rig) {
  return roles_of(rig, Backend::simulated).any();
}

std::string backends_text(const RigFile& rig) {
  const std::string cart = backend_name(rig.cart_encoder), pendulum = backend_name(rig.pendulum_encoder);
  const std::string output = backend_name(rig.output);
  if (cart != pendulum)
    return "cart's encoder " + cart + ", pendulum's encoder " + pendulum + ", output " + output;
  return cart == output ? output : "encoders " + cart + ", output " + output;
}

Calibration calibration_in_use(const RigFile& rig) {
  Calibration calibration = rig.calibration;
  if (!is_simulated(rig) || !rig.simulated || rig.simulated->quantise) return calibration;
  for (EncoderCalibration* encoder : {&calibration.cart, &calibration.pendulum}) {
    encoder->per_count /= finer_without_quantisation;
    encoder->width_bits = 32;
  }
  calibration.cart_zero_counts *= finer_without_quantisation;
  calibration.pendulum_zero_counts *= finer_without_quantisation;
  return calibration;
}

RigFile read_rig(const YamlMap& document) {
  RigFile rig;
  rig.file = document.file();
  read_backends(document, rig);
  rig.calibration = read_calibration(document.map("calibration"));
  const YamlMap amplifier = document.map("amplifier");
  rig.amplifier.limit_v = amplifier.number("limit_v", Range{0, 100, true});
  rig.amplifier.sign = read_sign(amplifier);
  amplifier.finish();
  const YamlMap track = document.map("track");
  rig.track_limit_m = track.number("limit_m", Range{0, 100, true});
  rig.coast_s = track.number_or("coast_s", 0.0, Range::within(0, 10));
  track.finish();
  rig.fall_angle_rad = document.number("fall_angle_rad", Range{0, std::numbers::pi, true});
  rig.watchdog_s = document.number("watchdog_s", Range{0, RigFile::longest_watchdog_s, true});
  rig.spin_us = document.number_or("spin_us", 0.0, Range::within(0, longest_spin_us));
  if (uses(rig, Backend::simulated) || document.has("simulated"))
    rig.simulated = read_simulated(document.map("simulated"));
  for (std::size_t i = 0; i < all_backends.size(); ++i)
    if (const BackendKind kind = all_backends[i](); kind.read && uses(rig, static_cast<Backend>(i)))
      kind.read(document, rig);
  if (uses(rig, Backend::gpio) || document.has("gpio")) rig.gpio = read_gpio(document.map("gpio"));
  if (const auto watch = document.optional_map("encoder_watch"))
    rig.encoder_watch = read_encoder_assumptions(*watch);
  check_gpio_roles(document, rig);
  document.finish();
  return rig;
}

RigFile read_rig_file(const std::filesystem::path& file) {
  return read_rig(YamlMap::from_file(file));
}

std::string rig_text(const RigFile& rig) {
  std::string text = backend_line(rig);
  text += calibration_text(rig.calibration);
  text += "amplifier: {limit_v: " + exact_text(rig.amplifier.limit_v) +
          ", sign: " + std::to_string(rig.amplifier.sign) +
          "}\ntrack: {limit_m: " + exact_text(rig.track_limit_m) + ", coast_s: " + exact_text(rig.coast_s) +
          "}\nfall_angle_rad: " + exact_text(rig.fall_angle_rad) +
          "\nwatchdog_s: " + exact_text(rig.watchdog_s) + "\n";
  if (rig.spin_us > 0.0) text += "spin_us: " + exact_text(rig.spin_us) + "\n";
  if (rig.simulated) text += simulated_text(*rig.simulated);
  for (DescribeBackend* describe : all_backends)
    if (const BackendKind kind = describe(); kind.text) text += kind.text(rig);
  if (rig.gpio) text += gpio_text(*rig.gpio);
  if (rig.encoder_watch) text += "encoder_watch: " + encoder_assumptions_text(*rig.encoder_watch) + "\n";
  return text;
}

}  // namespace upright
