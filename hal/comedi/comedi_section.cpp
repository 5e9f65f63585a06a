// The keys of section `comedi` of a rig file. What the device offers is checked when it is opened.

#include <algorithm>
#include <cmath>
#include <vector>

#include "../backends.hpp"
#include "base/yaml_keys.hpp"
#include "comedi_rig.hpp"

namespace upright {

namespace {

constexpr int last_subdevice = 255;
constexpr int last_comedi_channel = 65535;
constexpr int last_line = 15;
constexpr Words<3> kinds = {"counter", "plain_counter", "analog_input"};
constexpr Words<4> references = {"ground", "common", "difference", "other"};

/// A text that may be empty, which others must then replace.
void device_key(YamlKeys& keys, std::string& device, const std::string& otherwise) {
  keys.text("device", device, otherwise);
  if (!keys.decides_by_pattern("device", "[\\s\\S]", !device.empty())) device.clear();
}

/// A channel of a device: the section's own, unless this part of the rig names another.
template <class Channel>
void channel_keys(YamlKeys& keys, const std::string& device, Channel& channel) {
  if (keys.decides_by_presence("device", true))
    device_key(keys, channel.device, device);
  else
    channel.device = device;
  keys.needs("device", !channel.device.empty(), "is missing here and in comedi", "add device: /dev/comedi0");
  keys.integer("subdevice", channel.subdevice, 0, last_subdevice);
  keys.integer("channel", channel.channel, 0, last_comedi_channel);
}

void range_key(YamlKeys& keys, ComediRange& range) {
  constexpr double largest_v = 1000.0;
  std::vector<double> ends = {range.low_v, range.high_v};
  keys.numbers("range_v", ends, Range::within(-largest_v, largest_v));
  constexpr const char* remedy = "write the lower and the upper end, such as [-10, 10]";
  keys.check_size("range_v", ends.size(), 2, 2, "is not a range", remedy);
  keys.check("range_v", ends[0] < ends[1], "is not a range", remedy);
  range = {ends[0], ends[1]};
}

void line_keys(YamlKeys& keys, ComediLines& lines) {
  keys.integer("a", lines.a, 0, last_line);
  keys.integer("b", lines.b, 0, last_line);
  keys.check("b", lines.a != lines.b, "is also the line of a", "use a different line for each");
}

void analog_keys(YamlKeys& keys, int width_bits, ComediEncoder& encoder) {
  range_key(keys, encoder.range);
  keys.one_of("reference", encoder.reference, references, ComediReference::ground);
  keys.number("counts_per_v", encoder.counts_per_v, Range{1e-3, 1e9});
  const double largest_v = std::max(std::abs(encoder.range.low_v), std::abs(encoder.range.high_v));
  const double room = std::ldexp(1.0, width_bits - 1) - 1.0;
  keys.check("counts_per_v", largest_v * encoder.counts_per_v <= room,
             "gives more counts than the calibration's " + std::to_string(width_bits) + " bits can hold",
             "reduce counts_per_v to at most " + exact_text(std::floor(room / largest_v)) +
                 ", or set width_bits to 32");
}

void encoder_keys(YamlKeys& keys, const std::string& device, int width_bits, ComediEncoder& encoder) {
  keys.one_of("kind", encoder.kind, kinds);
  channel_keys(keys, device, encoder);
  if (encoder.kind == ComediEncoderKind::analog_input) analog_keys(keys, width_bits, encoder);
  if (encoder.kind == ComediEncoderKind::counter) keys.optional_map("lines", encoder.lines, line_keys);
}

void output_keys(YamlKeys& keys, const std::string& device, double limit_v, ComediOutput& output) {
  channel_keys(keys, device, output);
  range_key(keys, output.range);
  keys.number("amplifier_gain", output.amplifier_gain, Range::within(1e-3, 1e3));
  const double room_v = output.amplifier_gain * std::min(-output.range.low_v, output.range.high_v);
  keys.check("range_v", room_v > 0.0, "does not contain zero volts", "use a range such as [-10, 10]");
  keys.check("range_v", room_v >= limit_v, "times amplifier_gain is less than amplifier.limit_v",
             "reduce amplifier.limit_v to at most " + exact_text(room_v));
}

bool same_channel(const ComediEncoder& a, const ComediEncoder& b) {
  return a.device == b.device && a.subdevice == b.subdevice && a.channel == b.channel;
}

void comedi_keys(YamlKeys& keys, const RigFile& rig, ComediRig& comedi) {
  std::string device;  // in a text each part names its own
  if (keys.decides_by_presence("device", false)) device_key(keys, device, "");
  const RigRoles roles = roles_of(rig, Backend::comedi);
  const auto encoder = [&](const char* key, const EncoderCalibration& calibration,
                           std::optional<ComediEncoder>& channel) {
    keys.map(key, [&](YamlKeys& map) {
      encoder_keys(map, device, calibration.width_bits, YamlKeys::made(channel));
    });
  };
  if (roles.cart) encoder("cart", rig.calibration.cart, comedi.cart);
  if (roles.pendulum) encoder("pendulum", rig.calibration.pendulum, comedi.pendulum);
  if (comedi.cart && comedi.pendulum)
    keys.check("pendulum", !same_channel(*comedi.cart, *comedi.pendulum), "is the same channel as cart",
               "use a different channel for each encoder");
  if (roles.output)
    keys.map("output", [&](YamlKeys& map) {
      output_keys(map, device, rig.amplifier.limit_v, YamlKeys::made(comedi.output));
    });
}

}  // namespace

BackendKind comedi_backend() {
  const auto keys = [](YamlKeys& document, RigFile& rig) {
    document.section_of("comedi", rig.comedi,
                        [&](YamlKeys& section, ComediRig& comedi) { comedi_keys(section, rig, comedi); });
  };
  const auto make = [](const RigFile& rig, double period_s) -> std::unique_ptr<Rig> {
    return std::make_unique<ComediTransport>(rig, period_s);
  };
  return {"comedi", keys, make};
}

}  // namespace upright
