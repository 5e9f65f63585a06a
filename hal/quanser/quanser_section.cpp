#include "quanser_section.hpp"

#include <algorithm>
#include <filesystem>

#include "../backends.hpp"
#include "../quoted.hpp"
#include "../yaml_words.hpp"
#include "card_kinds.hpp"
#include "quanser_rig.hpp"

namespace upright {

namespace {

constexpr int last_channel = 255;
constexpr std::size_t longest_board_type = 64;
constexpr std::size_t longest_text = 1000;
constexpr Words<2> levels = {"low", "high"};

std::string words(const YamlMap& map, const std::string& key, const std::string& text, std::size_t longest) {
  if (text.empty()) map.fail(key, "is empty", "give it, or remove the key where it may be left out");
  if (text.size() > longest || text.find('\0') != std::string::npos)
    map.fail(key, "is no name", "give at most " + std::to_string(longest) + " characters");
  return text;
}

std::string read_words(const YamlMap& map, const std::string& key, const std::string& otherwise) {
  return map.has(key) ? words(map, key, map.text(key), longest_text) : otherwise;
}

/// Absolute, so that what is a path here never becomes a name that the loader searches for.
std::string absolute_path(const YamlMap& map, const std::string& key) {
  return std::filesystem::absolute(map.path(key)).string();
}

/// A name is the loader's affair; a path is relative to the rig file, like any other.
std::string read_library(const YamlMap& map) {
  if (!map.has("library")) return QuanserRig{}.library;
  const std::string name = words(map, "library", map.text("library"), longest_text);
  return name.find('/') == std::string::npos ? name : absolute_path(map, "library");
}

int read_channel(const YamlMap& map, const std::string& key, int there, const std::string& board_type) {
  const auto channel = static_cast<int>(map.integer(key, 0, last_channel));
  if (there > 0 && channel >= there)
    map.fail(key, "is " + std::to_string(channel) + ", which a " + board_type + " does not have",
             "give 0 to " + std::to_string(there - 1));
  return channel;
}

void read_encoders(const YamlMap& map, const RigRoles& roles, const QuanserCardKind* kind, QuanserRig& rig) {
  const int there = kind == nullptr ? 0 : kind->encoders;
  if (roles.cart) rig.cart_channel = read_channel(map, "cart", there, rig.board_type);
  if (roles.pendulum) rig.pendulum_channel = read_channel(map, "pendulum", there, rig.board_type);
  if (rig.cart_channel && rig.cart_channel == rig.pendulum_channel)
    map.fail("pendulum", "is the channel of cart", "give each encoder its own channel");
  map.finish();
}

/// The lowest bits of a wider counter count the same motion.
void narrow(EncoderCalibration& encoder, std::int64_t& zero_counts, int card_bits) {
  if (encoder.width_bits <= card_bits) return;
  encoder.width_bits = card_bits;
  zero_counts = signed_counts(zero_counts, card_bits);
}

void follow_at_width_of(const QuanserCardKind& kind, const RigRoles& roles, Calibration& calibration) {
  if (kind.counter_bits == 0) return;
  if (roles.cart) narrow(calibration.cart, calibration.cart_zero_counts, kind.counter_bits);
  if (roles.pendulum) narrow(calibration.pendulum, calibration.pendulum_zero_counts, kind.counter_bits);
}

void read_range(const YamlMap& map, QuanserOutput& output) {
  constexpr double largest_v = 100.0;
  const std::vector<double> ends = map.numbers("output_range_v", Range::within(-largest_v, largest_v));
  if (ends.size() != 2 || ends[0] >= 0.0 || ends[1] <= 0.0)
    map.fail("output_range_v", "is not a range around zero volts",
             "give the lower and the upper end, such as [-10, 10]");
  output.low_v = ends[0];
  output.high_v = ends[1];
  output.sets_range = true;
}

QuanserOutput read_output(const YamlMap& map, const QuanserCardKind* kind, const std::string& board_type,
                          Amplifier& amplifier) {
  QuanserOutput output;
  output.channel =
      read_channel(map, "analog_output_channel", kind == nullptr ? 0 : kind->analog_outputs, board_type);
  if (map.has("output_range_v")) read_range(map, output);
  output.amplifier_gain = map.number_or("amplifier_gain", 1.0, Range::within(1e-3, 1e3));
  const double room_v = output.amplifier_gain * std::min(-output.low_v, output.high_v);
  if (room_v >= amplifier.limit_v) return output;
  if (output.sets_range || map.has("amplifier_gain"))
    map.fail(map.has("amplifier_gain") ? "amplifier_gain" : "output_range_v",
             "leaves no room for the amplifier's limit",
             "give amplifier.limit_v at most " + exact_text(room_v));
  amplifier.limit_v = room_v;
  return output;
}

QuanserEnable read_enable(const YamlMap& map) {
  QuanserEnable enable;
  enable.line = static_cast<int>(map.integer("line", 0, last_channel));
  if (map.has("active")) enable.active_high = choose<int>(map, "active", levels) == 1;
  map.finish();
  return enable;
}

double read_watchdog(const YamlMap& map, const QuanserCardKind* kind, const std::string& board_type) {
  if (!map.has("watchdog_s")) return 0.0;
  const double time_s = map.number("watchdog_s", Range{0.0, RigFile::longest_watchdog_s, true});
  if (kind != nullptr && (time_s < kind->shortest_watchdog_s || time_s > kind->longest_watchdog_s))
    map.fail("watchdog_s", "is not a time that the watchdog of a " + board_type + " can be set to",
             "give " + exact_text(kind->shortest_watchdog_s) + " to " + exact_text(kind->longest_watchdog_s));
  return time_s;
}

}  // namespace

QuanserRig read_quanser(const YamlMap& map, RigFile& rig) {
  const RigRoles roles = roles_of(rig, Backend::quanser_hil);
  QuanserRig quanser;
  quanser.library = read_library(map);
  quanser.folder = map.has("folder") ? absolute_path(map, "folder") : "";
  quanser.common_library = read_words(map, "common_library", quanser.common_library);
  quanser.runtime_library = read_words(map, "runtime_library", quanser.runtime_library);
  quanser.board_type = words(map, "board_type", map.text("board_type"), longest_board_type);
  quanser.board_identifier = read_words(map, "board_identifier", "0");
  quanser.board_options = read_words(map, "board_options", "");
  const QuanserCardKind* kind = quanser_card_kind(quanser.board_type);
  if (roles.encoders()) read_encoders(map.map("encoder_channels"), roles, kind, quanser);
  if (kind != nullptr) follow_at_width_of(*kind, roles, rig.calibration);
  if (roles.output) {
    quanser.output = read_output(map, kind, quanser.board_type, rig.amplifier);
    if (const auto enable = map.optional_map("amplifier_enable"))
      quanser.amplifier_enable = read_enable(*enable);
    quanser.watchdog_s = read_watchdog(map, kind, quanser.board_type);
  }
  map.finish();
  return quanser;
}

std::string quanser_text(const QuanserRig& rig) {
  std::string text = "quanser_hil:\n  library: " + quoted(rig.library) + "\n";
  if (!rig.folder.empty()) text += "  folder: " + quoted(rig.folder) + "\n";
  text += "  common_library: " + quoted(rig.common_library) +
          "\n  runtime_library: " + quoted(rig.runtime_library) +
          "\n  board_type: " + quoted(rig.board_type) +
          "\n  board_identifier: " + quoted(rig.board_identifier) + "\n";
  if (!rig.board_options.empty()) text += "  board_options: " + quoted(rig.board_options) + "\n";
  if (rig.cart_channel || rig.pendulum_channel) {
    text += "  encoder_channels: {";
    if (rig.cart_channel) text += "cart: " + std::to_string(*rig.cart_channel);
    if (rig.pendulum_channel)
      text += (rig.cart_channel ? ", pendulum: " : "pendulum: ") + std::to_string(*rig.pendulum_channel);
    text += "}\n";
  }
  if (!rig.output) return text;
  text += "  analog_output_channel: " + std::to_string(rig.output->channel) + "\n";
  if (rig.output->sets_range)
    text +=
        "  output_range_v: [" + exact_text(rig.output->low_v) + ", " + exact_text(rig.output->high_v) + "]\n";
  text += "  amplifier_gain: " + exact_text(rig.output->amplifier_gain) + "\n";
  if (rig.amplifier_enable)
    text += "  amplifier_enable: {line: " + std::to_string(rig.amplifier_enable->line) +
            ", active: " + word_of(rig.amplifier_enable->active_high ? 1 : 0, levels) + "}\n";
  if (rig.watchdog_s > 0.0) text += "  watchdog_s: " + exact_text(rig.watchdog_s) + "\n";
  return text;
}

BackendKind quanser_backend() {
  const auto read = [](const YamlMap& document, RigFile& rig) {
    rig.quanser = read_quanser(document.map("quanser_hil"), rig);
  };
  const auto text = [](const RigFile& rig) {
    return rig.quanser ? quanser_text(*rig.quanser) : std::string();
  };
  const auto make = [](const RigFile& rig, double period_s) -> std::unique_ptr<Rig> {
    return std::make_unique<QuanserTransport>(rig, period_s);
  };
  return {"quanser-hil", read, text, make};
}

}  // namespace upright
