// The keys of section `quanser_hil` of a rig file. What is read narrows calibration and amplifier to what the
// card can do where the file leaves it open: counters are followed at the card's own width, and without
// `output_range_v` and `amplifier_gain` the amplifier's limit is at most what the card puts out.

#include <algorithm>
#include <filesystem>
#include <vector>

#include "../backends.hpp"
#include "base/yaml_keys.hpp"
#include "card_kinds.hpp"
#include "hal/level_words.hpp"
#include "quanser_rig.hpp"

namespace upright {

namespace {

constexpr int last_channel = 255;
constexpr std::size_t longest_board_type = 64;
constexpr std::size_t longest_text = 1000;
constexpr Words<2> clocks = {"computer", "card"};

/// A name of the loader's or the card's.
void name_key(YamlKeys& keys, const char* key, std::string& name, std::size_t longest) {
  keys.text(key, name);
  Admitted form;
  form.max_length = longest;
  keys.check_form(key, name.size() <= longest && name.find('\0') == std::string::npos, form,
                  "is too long or contains a null character",
                  "use at most " + std::to_string(longest) + " characters");
}

/// Left out, it stays as it is. An empty one is not written.
void optional_name_key(YamlKeys& keys, const char* key, std::string& name) {
  if (keys.given(key, !name.empty())) name_key(keys, key, name, longest_text);
}

/// Absolute, so that what is a path here never becomes a name that the loader searches for.
std::string absolute_path(const YamlMap& map, const std::string& key) {
  return std::filesystem::absolute(map.path(key)).string();
}

/// A name is the loader's affair; a path is relative to the rig file, like any other.
void library_key(YamlKeys& keys, std::string& library) {
  optional_name_key(keys, "library", library);
  if (const YamlMap* map = keys.source(); map && library.find('/') != std::string::npos)
    library = absolute_path(*map, "library");
}

void folder_key(YamlKeys& keys, std::string& folder) {
  if (!keys.given("folder", !folder.empty())) return;
  std::filesystem::path path = folder;
  keys.path("folder", path);
  folder = std::filesystem::absolute(path).string();
}

void channel_key(YamlKeys& keys, const char* key, int& channel, int there, const std::string& board_type) {
  keys.integer(key, channel, 0, last_channel);
  keys.check(key, there == 0 || channel < there,
             "is " + std::to_string(channel) + ", which a " + board_type + " does not have",
             "use 0 to " + std::to_string(there - 1));
}

void encoder_keys(YamlKeys& keys, const RigRoles& roles, const QuanserCardKind* kind, QuanserRig& rig) {
  const int there = kind == nullptr ? 0 : kind->encoders;
  if (roles.cart) channel_key(keys, "cart", YamlKeys::made(rig.cart_channel), there, rig.board_type);
  if (roles.pendulum)
    channel_key(keys, "pendulum", YamlKeys::made(rig.pendulum_channel), there, rig.board_type);
  keys.check("pendulum", !rig.cart_channel || rig.cart_channel != rig.pendulum_channel,
             "is the same channel as cart", "use a different channel for each encoder");
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

void range_key(YamlKeys& keys, QuanserOutput& output) {
  constexpr double largest_v = 100.0;
  if (!keys.given("output_range_v", output.sets_range)) return;
  std::vector<double> ends = {output.low_v, output.high_v};
  keys.numbers("output_range_v", ends, Range::within(-largest_v, largest_v));
  constexpr const char* problem = "does not contain zero volts";
  constexpr const char* remedy = "write the lower and the upper end, such as [-10, 10]";
  keys.check_size("output_range_v", ends.size(), 2, 2, problem, remedy);
  keys.check("output_range_v", ends[0] < 0.0 && ends[1] > 0.0, problem, remedy);
  output.low_v = ends[0];
  output.high_v = ends[1];
  output.sets_range = true;
}

/// Lowers a limit that is above what the card puts out, unless the file says what that is.
void limit_to_room(const YamlMap& map, const QuanserOutput& output, Amplifier& amplifier) {
  const double room_v = output.amplifier_gain * std::min(-output.low_v, output.high_v);
  if (room_v >= amplifier.limit_v) return;
  const bool has_gain = map.has("amplifier_gain");
  if (output.sets_range || has_gain)
    map.fail(has_gain ? "amplifier_gain" : "output_range_v", "is too small for amplifier.limit_v",
             "reduce amplifier.limit_v to at most " + exact_text(room_v));
  amplifier.limit_v = room_v;
}

void output_keys(YamlKeys& keys, const QuanserCardKind* kind, const std::string& board_type,
                 QuanserOutput& output, Amplifier& amplifier) {
  channel_key(keys, "analog_output_channel", output.channel, kind == nullptr ? 0 : kind->analog_outputs,
              board_type);
  range_key(keys, output);
  keys.number("amplifier_gain", output.amplifier_gain, Range::within(1e-3, 1e3), 1.0);
  if (const YamlMap* map = keys.source()) limit_to_room(*map, output, amplifier);
}

void enable_keys(YamlKeys& keys, QuanserEnable& enable) {
  keys.integer("line", enable.line, 0, last_channel);
  keys.one_of("active", enable.active_high, level_words, true);
}

void watchdog_key(YamlKeys& keys, const QuanserCardKind* kind, QuanserRig& rig) {
  keys.number("watchdog_s", rig.watchdog_s, Range{0.0, RigFile::longest_watchdog_s, true}, 0.0,
              Usual::left_out);
  if (kind == nullptr || rig.watchdog_s <= 0.0) return;
  keys.check("watchdog_s",
             rig.watchdog_s >= kind->shortest_watchdog_s && rig.watchdog_s <= kind->longest_watchdog_s,
             "is not a time that the watchdog of a " + rig.board_type + " supports",
             "use " + exact_text(kind->shortest_watchdog_s) + " to " + exact_text(kind->longest_watchdog_s));
}

void quanser_keys(YamlKeys& keys, RigFile& rig, QuanserRig& quanser) {
  const RigRoles roles = roles_of(rig, Backend::quanser_hil);
  library_key(keys, quanser.library);
  folder_key(keys, quanser.folder);
  optional_name_key(keys, "common_library", quanser.common_library);
  optional_name_key(keys, "runtime_library", quanser.runtime_library);
  name_key(keys, "board_type", quanser.board_type, longest_board_type);
  optional_name_key(keys, "board_identifier", quanser.board_identifier);
  optional_name_key(keys, "board_options", quanser.board_options);
  const QuanserCardKind* kind = quanser_card_kind(quanser.board_type);
  if (roles.encoders() && keys.given("clock", quanser.is_clock))
    keys.one_of("clock", quanser.is_clock, clocks);
  if (roles.encoders()) keys.flag("encoder_velocities", quanser.reads_velocities, false, Usual::left_out);
  if (roles.encoders())
    keys.map("encoder_channels", [&](YamlKeys& map) { encoder_keys(map, roles, kind, quanser); });
  if (kind != nullptr && keys.source()) follow_at_width_of(*kind, roles, rig.calibration);
  if (!roles.output) return;
  output_keys(keys, kind, quanser.board_type, YamlKeys::made(quanser.output), rig.amplifier);
  keys.optional_map("amplifier_enable", quanser.amplifier_enable, enable_keys);
  watchdog_key(keys, kind, quanser);
}

}  // namespace

BackendKind quanser_backend() {
  const auto keys = [](YamlKeys& document, RigFile& rig) {
    document.section_of("quanser_hil", rig.quanser,
                        [&](YamlKeys& section, QuanserRig& quanser) { quanser_keys(section, rig, quanser); });
  };
  const auto make = [](const RigFile& rig, double period_s) -> std::unique_ptr<Rig> {
    return std::make_unique<QuanserTransport>(rig, period_s);
  };
  return {"quanser-hil", keys, make};
}

}  // namespace upright
