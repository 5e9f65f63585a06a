#include "gpio_section.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "../backends.hpp"
#include "../gpio_rig.hpp"
#include "hal/level_words.hpp"

namespace upright {

namespace {

constexpr int highest_line = 1023;
constexpr std::size_t max_limit_switches = 8;
constexpr Words<3> biases = {"as_is", "pull_up", "pull_down"};
constexpr Words<2> track_ends = {"plus_x", "minus_x"};

/// Line numbers with the keys that took them: no two may share one.
class TakenLines {
 public:
  void line_key(YamlKeys& keys, const char* key, int& line) {
    keys.integer(key, line, 0, highest_line);
    keys.check(key, std::find(lines_.begin(), lines_.end(), line) == lines_.end(),
               "is " + std::to_string(line) + ", which is already in use", "use a different line for each");
    lines_.push_back(line);
  }
  bool empty() const { return lines_.empty(); }

 private:
  std::vector<int> lines_;
};

void bias_key(YamlKeys& keys, LineBias& bias) {
  keys.one_of("bias", bias, biases, LineBias::as_is);
}

void level_keys(YamlKeys& keys, DigitalLine& line, TakenLines& taken) {
  taken.line_key(keys, "line", line.line);
  keys.one_of("active", line.active_high, level_words);
}

void input_keys(YamlKeys& keys, DigitalLine& line, TakenLines& taken) {
  level_keys(keys, line, taken);
  bias_key(keys, line.bias);
}

void encoder_keys(YamlKeys& keys, LineEncoder& encoder, TakenLines& taken) {
  taken.line_key(keys, "a", encoder.a);
  taken.line_key(keys, "b", encoder.b);
  bias_key(keys, encoder.bias);
  keys.number("fastest_edges_per_s", encoder.fastest_edges_per_s, Range{100, 20'000});
}

void line_encoder_keys(YamlKeys& keys, const char* key, std::optional<LineEncoder>& encoder,
                       TakenLines& taken) {
  if (keys.decides_by_presence(key, encoder.has_value()))
    keys.map(key, [&](YamlKeys& map) { encoder_keys(map, YamlKeys::made(encoder), taken); });
  else
    encoder.reset();
}

void line_keys(YamlKeys& keys, GpioRig& rig, TakenLines& taken) {
  const auto input = [&](YamlKeys& map, DigitalLine& line) { input_keys(map, line, taken); };
  const auto output = [&](YamlKeys& map, DigitalLine& line) { level_keys(map, line, taken); };
  keys.text("chip", rig.chip);
  keys.optional_map("emergency_stop", rig.emergency_stop, input);
  if (keys.given("limit_switches", !rig.limit_switches.empty())) {
    keys.items("limit_switches", rig.limit_switches, [&](YamlKeys& map, LimitSwitch& limit) {
      map.one_of("end", limit.end, track_ends);
      input_keys(map, limit.line, taken);
    });
    const std::size_t count = rig.limit_switches.size();
    keys.check_size(
        "limit_switches", count, 1, max_limit_switches, "has " + std::to_string(count) + " switches",
        "list 1 to " + std::to_string(max_limit_switches) + " switches, or remove limit_switches");
  }
  keys.optional_map("amplifier_enable", rig.amplifier_enable, output);
  keys.optional_map("heartbeat", rig.heartbeat,
                    [&](YamlKeys& map, int& line) { taken.line_key(map, "line", line); });
  line_encoder_keys(keys, "cart_encoder", rig.cart_encoder, taken);
  line_encoder_keys(keys, "pendulum_encoder", rig.pendulum_encoder, taken);
  if (const YamlMap* map = keys.source()) map->finish();
  keys.needs_any("chip",
                 {"emergency_stop", "limit_switches", "amplifier_enable", "heartbeat", "cart_encoder",
                  "pendulum_encoder"},
                 !taken.empty(), "has no line in use",
                 "add a line, such as emergency_stop, or remove the section gpio");
}

/// The section has the encoders that the rig takes from it, and no others.
void need_encoders_of(YamlKeys& keys, const RigRoles& roles, const GpioRig& rig) {
  const auto match = [&](const char* key, bool is_wanted, bool is_there) {
    keys.needs(key, is_there || !is_wanted, "is missing, but backend reads its counts from gpio",
               std::string("add ") + key + " (its lines a and b)");
    keys.needs(key, is_wanted || !is_there,
               "is not used, because backend reads its counts from another backend",
               std::string("remove ") + key + ", or use gpio as its backend");
  };
  match("cart_encoder", roles.cart, rig.cart_encoder.has_value());
  match("pendulum_encoder", roles.pendulum, rig.pendulum_encoder.has_value());
}

}  // namespace

void gpio_keys(YamlKeys& document, RigFile& rig) {
  const RigRoles roles = roles_of(rig, Backend::gpio);
  document.section_of("gpio", rig.gpio, [&](YamlKeys& keys, GpioRig& gpio) {
    TakenLines taken;
    line_keys(keys, gpio, taken);
    document.needs("backend", !roles.output,
                   "uses gpio as output, but digital lines cannot carry the motor voltage",
                   "use another backend as output");
    need_encoders_of(keys, roles, gpio);
  });
}

BackendKind gpio_backend() {
  // Its section holds the lines of any rig, too: rig_file.cpp visits it.
  return {"gpio", nullptr, make_gpio_encoders};
}

}  // namespace upright
