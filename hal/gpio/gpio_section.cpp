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
constexpr Words<2> ends = {"plus_x", "minus_x"};

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

void rig_keys(YamlKeys& keys, GpioRig& rig, TakenLines& taken) {
  const auto input = [&](YamlKeys& map, DigitalLine& line) { input_keys(map, line, taken); };
  const auto output = [&](YamlKeys& map, DigitalLine& line) { level_keys(map, line, taken); };
  const auto encoder = [&](YamlKeys& map, LineEncoder& lines) { encoder_keys(map, lines, taken); };
  keys.text("chip", rig.chip);
  keys.optional_map("emergency_stop", rig.emergency_stop, input);
  if (keys.given("limit_switches", !rig.limit_switches.empty())) {
    keys.items("limit_switches", rig.limit_switches, [&](YamlKeys& map, LimitSwitch& limit) {
      map.one_of("end", limit.end, ends);
      input_keys(map, limit.line, taken);
    });
    const std::size_t count = rig.limit_switches.size();
    keys.check("limit_switches", count > 0 && count <= max_limit_switches,
               "has " + std::to_string(count) + " switches",
               "list 1 to " + std::to_string(max_limit_switches) + " switches, or remove limit_switches");
  }
  keys.optional_map("amplifier_enable", rig.amplifier_enable, output);
  keys.optional_map("heartbeat", rig.heartbeat,
                    [&](YamlKeys& map, int& line) { taken.line_key(map, "line", line); });
  keys.optional_map("cart_encoder", rig.cart_encoder, encoder);
  keys.optional_map("pendulum_encoder", rig.pendulum_encoder, encoder);
}

}  // namespace

void gpio_keys(YamlKeys& document, std::optional<GpioRig>& rig) {
  TakenLines taken;
  document.section_of("gpio", rig, [&](YamlKeys& keys, GpioRig& gpio) { rig_keys(keys, gpio, taken); });
  if (const YamlMap* map = document.source(); map && taken.empty())
    map->map("gpio").fail("chip", "has no line in use",
                          "add a line, such as emergency_stop, or remove the section gpio");
}

BackendKind gpio_backend() {
  // Its section holds the lines of any rig, too: rig_file.cpp visits it.
  return {"gpio", nullptr, make_gpio_encoders};
}

}  // namespace upright
