#include "upright/hal/rig_file.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "backends.hpp"
#include "base/yaml_keys.hpp"
#include "gpio/gpio_section.hpp"
#include "rig_keys.hpp"
#include "simulated/simulated_section.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

constexpr int finer_without_quantisation = 1024;
constexpr double longest_spin_us = 1e4;  // the loop also keeps it below half a period

constexpr Words<2> poses = {"upright", "hanging"};
constexpr Words<2> zeros = {"counts", "start"};

void sign_key(YamlKeys& keys, int& sign) {
  keys.integer("sign", sign, -1, 1);
  keys.check_not_zero("sign", sign, "is 0", "use 1 or -1");
}

/// Counts per revolution that give the same radians per count, bit for bit.
double counts_per_revolution(double rad_per_count) {
  const double turn = 2.0 * std::numbers::pi;
  const double near = turn / rad_per_count;
  if (turn / std::nearbyint(near) == rad_per_count) return std::nearbyint(near);
  double low = near, high = near;
  for (int i = 0; i < 16; ++i) {
    if (turn / low == rad_per_count) return low;
    if (turn / high == rad_per_count) return high;
    low = std::nextafter(low, 0.0);
    high = std::nextafter(high, 2.0 * high);
  }
  return near;
}

void counts_per_revolution_key(YamlKeys& keys, double& rad_per_count) {
  double counts = rad_per_count > 0.0 ? counts_per_revolution(rad_per_count) : 0.0;
  keys.number("counts_per_revolution", counts, Range{16, 1e8});
  rad_per_count = 2.0 * std::numbers::pi / counts;
}

void encoder_keys(YamlKeys& keys, EncoderCalibration& encoder, bool is_cart) {
  if (is_cart)
    keys.number("m_per_count", encoder.per_count, Range{1e-9, 1e-2});
  else
    counts_per_revolution_key(keys, encoder.per_count);
  sign_key(keys, encoder.sign);
  keys.integer("width_bits", encoder.width_bits, 8, 32);
  keys.number(is_cart ? "fastest_mps" : "fastest_radps", encoder.fastest_per_s, Range{1e-3, 1e4});
}

void zero_keys(YamlKeys& keys, Calibration& calibration) {
  keys.one_of("at", calibration.zero_at_start, zeros);
  if (!calibration.zero_at_start) {
    const auto low = [](int width_bits) { return -(std::int64_t{1} << (width_bits - 1)); };
    const auto high = [](int width_bits) { return (std::int64_t{1} << width_bits) - 1; };
    const int cart_bits = calibration.cart.width_bits, pendulum_bits = calibration.pendulum.width_bits;
    keys.integer("cart_counts", calibration.cart_zero_counts, low(cart_bits), high(cart_bits));
    keys.integer("pendulum_counts", calibration.pendulum_zero_counts, low(pendulum_bits),
                 high(pendulum_bits));
  }
  keys.one_of("pose", calibration.zero_pose, poses);
}

void calibration_keys(YamlKeys& keys, Calibration& calibration) {
  keys.map("cart", [&](YamlKeys& map) { encoder_keys(map, calibration.cart, true); });
  keys.map("pendulum", [&](YamlKeys& map) { encoder_keys(map, calibration.pendulum, false); });
  keys.map("zero", [&](YamlKeys& map) { zero_keys(map, calibration); });
}

void backend_key(YamlKeys& keys, const char* key, Backend& backend) {
  Words<all_backends.size()> names{};
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = all_backends[i]().name;
  keys.one_of(key, backend, names);
}

void backends_by_part(YamlKeys& keys, RigFile& rig) {
  const bool are_apart = rig.cart_encoder != rig.pendulum_encoder;
  if (keys.decides_by_presence("cart_encoder", are_apart) ||
      keys.decides_by_presence("pendulum_encoder", are_apart)) {
    backend_key(keys, "cart_encoder", rig.cart_encoder);
    backend_key(keys, "pendulum_encoder", rig.pendulum_encoder);
  } else {
    backend_key(keys, "encoders", rig.cart_encoder);
    rig.pendulum_encoder = rig.cart_encoder;
  }
  backend_key(keys, "output", rig.output);
}

void backend_keys(YamlKeys& document, RigFile& rig) {
  const bool is_one = rig.cart_encoder == rig.pendulum_encoder && rig.cart_encoder == rig.output;
  if (!document.is_map("backend", !is_one)) {
    backend_key(document, "backend", rig.output);
    rig.cart_encoder = rig.pendulum_encoder = rig.output;
    return;
  }
  document.deciding_map("backend", [&](YamlKeys& map) { backends_by_part(map, rig); });
  const RigRoles simulated = roles_of(rig, Backend::simulated);
  document.needs("backend", !simulated.any() || simulated.all(),
                 "combines simulated with hardware, but a simulated plant responds only to its own output",
                 "use simulated for all parts or for none");
}

bool uses(const RigFile& rig, Backend backend) {
  return roles_of(rig, backend).any();
}

}  // namespace

void rig_keys(YamlKeys& document, RigFile& rig) {
  backend_keys(document, rig);
  document.section("calibration", [&](YamlKeys& keys) { calibration_keys(keys, rig.calibration); });
  document.map("amplifier", [&](YamlKeys& keys) {
    keys.number("limit_v", rig.amplifier.limit_v, Range{0, 100, true});
    sign_key(keys, rig.amplifier.sign);
  });
  document.map("track", [&](YamlKeys& keys) {
    keys.number("limit_m", rig.track_limit_m, Range{0, 100, true});
    keys.number("coast_s", rig.coast_s, Range::within(0, 10), 0.0);
  });
  document.number("fall_angle_rad", rig.fall_angle_rad, Range{0, std::numbers::pi, true});
  document.number("watchdog_s", rig.watchdog_s, Range{0, RigFile::longest_watchdog_s, true});
  document.number("spin_us", rig.spin_us, Range::within(0, longest_spin_us), 0.0, Usual::left_out);
  if (uses(rig, Backend::simulated) || document.given("simulated", rig.simulated.has_value()))
    document.section_of("simulated", rig.simulated, simulated_keys);
  for (std::size_t i = 0; i < all_backends.size(); ++i)
    if (const BackendKind kind = all_backends[i](); kind.keys && uses(rig, static_cast<Backend>(i)))
      kind.keys(document, rig);
  if (uses(rig, Backend::gpio) || document.given("gpio", rig.gpio.has_value())) gpio_keys(document, rig);
  document.optional_map("encoder_watch", rig.encoder_watch, encoder_assumption_keys);
}

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
    return "cart encoder " + cart + ", pendulum encoder " + pendulum + ", output " + output;
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
  YamlKeyReader reader(document);
  rig_keys(reader, rig);
  document.finish();
  return rig;
}

RigFile read_rig_file(const std::filesystem::path& file) {
  return read_rig(YamlMap::from_file(file));
}

std::string rig_text(const RigFile& rig) {
  RigFile copy = rig;
  YamlKeyWriter writer(YamlKeyWriter::Layout::lines);
  rig_keys(writer, copy);
  return writer.written();
}

}  // namespace upright
