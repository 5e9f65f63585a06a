#include "comedi_section.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "../backends.hpp"
#include "../quoted.hpp"
#include "../yaml_words.hpp"
#include "comedi_rig.hpp"

namespace upright {

namespace {

constexpr int last_subdevice = 255;
constexpr int last_channel = 65535;
constexpr int last_line = 15;
constexpr Words<3> kinds = {"counter", "plain_counter", "analog_input"};
constexpr Words<4> references = {"ground", "common", "difference", "other"};

/// A channel of a device: the section's own, unless this part of the rig names another.
template <class Channel>
void read_channel(const YamlMap& map, const std::string& device, Channel& channel) {
  channel.device = map.text_or("device", device);
  if (channel.device.empty()) map.fail("device", "is missing here and in comedi", "add device: /dev/comedi0");
  channel.subdevice = small_integer(map, "subdevice", 0, last_subdevice);
  channel.channel = small_integer(map, "channel", 0, last_channel);
}

ComediRange read_range(const YamlMap& map) {
  constexpr double largest_v = 1000.0;
  const std::vector<double> ends = map.numbers("range_v", Range::within(-largest_v, largest_v));
  if (ends.size() != 2 || ends[0] >= ends[1])
    map.fail("range_v", "is not a range", "give the lower and the upper end, such as [-10, 10]");
  return {ends[0], ends[1]};
}

ComediLines read_lines(const YamlMap& map) {
  const ComediLines lines = {small_integer(map, "a", 0, last_line), small_integer(map, "b", 0, last_line)};
  if (lines.a == lines.b) map.fail("b", "is the line of a", "give A and B a line each");
  map.finish();
  return lines;
}

void read_analog(const YamlMap& map, int width_bits, ComediEncoder& encoder) {
  encoder.range = read_range(map);
  if (map.has("reference")) encoder.reference = choose<ComediReference>(map, "reference", references);
  encoder.counts_per_v = map.number("counts_per_v", Range{1e-3, 1e9});
  const double most = std::max(std::abs(encoder.range.low_v), std::abs(encoder.range.high_v));
  const double room = std::ldexp(1.0, width_bits - 1) - 1.0;
  if (most * encoder.counts_per_v > room)
    map.fail("counts_per_v",
             "makes more counts than the calibration's " + std::to_string(width_bits) + " bits hold",
             "give counts_per_v at most " + exact_text(std::floor(room / most)) + ", or width_bits 32");
}

ComediEncoder read_encoder(const YamlMap& map, const std::string& device, int width_bits) {
  ComediEncoder encoder;
  encoder.kind = choose<ComediEncoderKind>(map, "kind", kinds);
  read_channel(map, device, encoder);
  if (encoder.kind == ComediEncoderKind::analog_input) read_analog(map, width_bits, encoder);
  if (encoder.kind == ComediEncoderKind::counter)
    if (const auto lines = map.optional_map("lines")) encoder.lines = read_lines(*lines);
  map.finish();
  return encoder;
}

ComediOutput read_output(const YamlMap& map, const std::string& device, double limit_v) {
  ComediOutput output;
  read_channel(map, device, output);
  output.range = read_range(map);
  output.amplifier_gain = map.number("amplifier_gain", Range::within(1e-3, 1e3));
  const double room_v = output.amplifier_gain * std::min(-output.range.low_v, output.range.high_v);
  if (room_v <= 0.0)
    map.fail("range_v", "has no zero volts between its ends",
             "give a range of both signs, such as [-10, 10]");
  if (room_v < limit_v)
    map.fail("range_v", "times amplifier_gain leaves no room for the amplifier's limit",
             "give amplifier.limit_v at most " + exact_text(room_v));
  map.finish();
  return output;
}

bool same_channel(const ComediEncoder& a, const ComediEncoder& b) {
  return a.device == b.device && a.subdevice == b.subdevice && a.channel == b.channel;
}

template <class Channel>
std::string channel_text(const Channel& channel) {
  return "device: " + quoted(channel.device) + ", subdevice: " + std::to_string(channel.subdevice) +
         ", channel: " + std::to_string(channel.channel);
}

std::string range_text(const ComediRange& range) {
  return ", range_v: [" + exact_text(range.low_v) + ", " + exact_text(range.high_v) + "]";
}

std::string encoder_text(const char* key, const ComediEncoder& encoder) {
  std::string text =
      std::string("  ") + key + ": {kind: " + word_of(encoder.kind, kinds) + ", " + channel_text(encoder);
  if (encoder.lines)
    text +=
        ", lines: {a: " + std::to_string(encoder.lines->a) + ", b: " + std::to_string(encoder.lines->b) + "}";
  if (encoder.kind == ComediEncoderKind::analog_input)
    text += range_text(encoder.range) + ", reference: " + word_of(encoder.reference, references) +
            ", counts_per_v: " + exact_text(encoder.counts_per_v);
  return text + "}\n";
}

}  // namespace

ComediRig read_comedi(const YamlMap& map, const RigFile& rig) {
  const std::string device = map.text_or("device", "");
  const RigRoles roles = roles_of(rig, Backend::comedi);
  ComediRig comedi;
  if (roles.cart) comedi.cart = read_encoder(map.map("cart"), device, rig.calibration.cart.width_bits);
  if (roles.pendulum)
    comedi.pendulum = read_encoder(map.map("pendulum"), device, rig.calibration.pendulum.width_bits);
  if (comedi.cart && comedi.pendulum && same_channel(*comedi.cart, *comedi.pendulum))
    map.fail("pendulum", "is the channel of cart", "give each encoder its own channel");
  if (roles.output) comedi.output = read_output(map.map("output"), device, rig.amplifier.limit_v);
  map.finish();
  return comedi;
}

std::string comedi_text(const ComediRig& rig) {
  std::string text = "comedi:\n";
  if (rig.cart) text += encoder_text("cart", *rig.cart);
  if (rig.pendulum) text += encoder_text("pendulum", *rig.pendulum);
  if (rig.output)
    text += "  output: {" + channel_text(*rig.output) + range_text(rig.output->range) +
            ", amplifier_gain: " + exact_text(rig.output->amplifier_gain) + "}\n";
  return text;
}

BackendKind comedi_backend() {
  const auto read = [](const YamlMap& document, RigFile& rig) {
    rig.comedi = read_comedi(document.map("comedi"), rig);
  };
  const auto text = [](const RigFile& rig) { return rig.comedi ? comedi_text(*rig.comedi) : std::string(); };
  const auto make = [](const RigFile& rig, double period_s) -> std::unique_ptr<Rig> {
    return std::make_unique<ComediTransport>(rig, period_s);
  };
  return {"comedi", read, text, make};
}

}  // namespace upright
