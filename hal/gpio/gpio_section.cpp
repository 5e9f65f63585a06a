#include "gpio_section.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "../backends.hpp"
#include "../gpio_rig.hpp"
#include "../quoted.hpp"
#include "../yaml_words.hpp"

namespace upright {

namespace {

constexpr int highest_line = 1023;
constexpr std::size_t most_limit_switches = 8;
constexpr Words<2> levels = {"low", "high"};
constexpr Words<3> biases = {"as_is", "pull_up", "pull_down"};
constexpr Words<2> ends = {"plus_x", "minus_x"};

/// Line numbers with the keys that took them: no two may share one.
class TakenLines {
 public:
  int take(const YamlMap& map, const std::string& key) {
    const auto line = small_integer(map, key, 0, highest_line);
    const bool is_taken = std::find(lines_.begin(), lines_.end(), line) != lines_.end();
    if (is_taken)
      map.fail(key, "is " + std::to_string(line) + ", which is in use already", "give each its own line");
    lines_.push_back(line);
    return line;
  }
  bool empty() const { return lines_.empty(); }

 private:
  std::vector<int> lines_;
};

LineBias read_bias(const YamlMap& map) {
  return map.has("bias") ? choose<LineBias>(map, "bias", biases) : LineBias::as_is;
}

DigitalLine read_line(const YamlMap& map, bool is_input, TakenLines& taken) {
  DigitalLine line;
  line.line = taken.take(map, "line");
  line.active_high = choose<int>(map, "active", levels) == 1;
  if (is_input) line.bias = read_bias(map);
  map.finish();
  return line;
}

LimitSwitch read_limit_switch(const YamlMap& map, TakenLines& taken) {
  LimitSwitch limit;
  limit.end = choose<TrackEnd>(map, "end", ends);
  limit.line = read_line(map, true, taken);
  return limit;
}

std::vector<LimitSwitch> read_limit_switches(const YamlMap& map, TakenLines& taken) {
  std::vector<LimitSwitch> switches;
  for (const YamlMap& limit : map.maps("limit_switches")) switches.push_back(read_limit_switch(limit, taken));
  if (switches.empty() || switches.size() > most_limit_switches)
    map.fail("limit_switches", "has " + std::to_string(switches.size()) + " of them",
             "list 1 to " + std::to_string(most_limit_switches) + " switches, or remove limit_switches");
  return switches;
}

LineEncoder read_encoder(const YamlMap& map, TakenLines& taken) {
  LineEncoder encoder;
  encoder.a = taken.take(map, "a");
  encoder.b = taken.take(map, "b");
  encoder.bias = read_bias(map);
  encoder.fastest_edges_per_s = map.number("fastest_edges_per_s", Range{100, 20'000});
  map.finish();
  return encoder;
}

std::string bias_text(LineBias bias) {
  return ", bias: " + word_of(bias, biases);
}

std::string input_text(const DigitalLine& line) {
  return "line: " + std::to_string(line.line) + ", active: " + word_of(line.active_high ? 1 : 0, levels) +
         bias_text(line.bias);
}

std::string encoder_text(const LineEncoder& encoder) {
  return "{a: " + std::to_string(encoder.a) + ", b: " + std::to_string(encoder.b) + bias_text(encoder.bias) +
         ", fastest_edges_per_s: " + exact_text(encoder.fastest_edges_per_s) + "}\n";
}

}  // namespace

GpioRig read_gpio(const YamlMap& map) {
  GpioRig rig;
  TakenLines taken;
  rig.chip = map.text("chip");
  if (const auto stop = map.optional_map("emergency_stop"))
    rig.emergency_stop = read_line(*stop, true, taken);
  if (map.has("limit_switches")) rig.limit_switches = read_limit_switches(map, taken);
  if (const auto enable = map.optional_map("amplifier_enable"))
    rig.amplifier_enable = read_line(*enable, false, taken);
  if (const auto heartbeat = map.optional_map("heartbeat")) {
    rig.heartbeat = taken.take(*heartbeat, "line");
    heartbeat->finish();
  }
  if (const auto cart = map.optional_map("cart_encoder")) rig.cart_encoder = read_encoder(*cart, taken);
  if (const auto pendulum = map.optional_map("pendulum_encoder"))
    rig.pendulum_encoder = read_encoder(*pendulum, taken);
  map.finish();
  if (taken.empty())
    map.fail("chip", "has no line in use", "name a line, such as emergency_stop, or remove the section gpio");
  return rig;
}

std::string gpio_text(const GpioRig& rig) {
  std::string text = "gpio:\n  chip: " + quoted(rig.chip) + "\n";
  if (rig.emergency_stop) text += "  emergency_stop: {" + input_text(*rig.emergency_stop) + "}\n";
  if (!rig.limit_switches.empty()) text += "  limit_switches:\n";
  for (const LimitSwitch& limit : rig.limit_switches)
    text += "    - {end: " + word_of(limit.end, ends) + ", " + input_text(limit.line) + "}\n";
  if (rig.amplifier_enable)
    text += "  amplifier_enable: {line: " + std::to_string(rig.amplifier_enable->line) +
            ", active: " + word_of(rig.amplifier_enable->active_high ? 1 : 0, levels) + "}\n";
  if (rig.heartbeat) text += "  heartbeat: {line: " + std::to_string(*rig.heartbeat) + "}\n";
  if (rig.cart_encoder) text += "  cart_encoder: " + encoder_text(*rig.cart_encoder);
  if (rig.pendulum_encoder) text += "  pendulum_encoder: " + encoder_text(*rig.pendulum_encoder);
  return text;
}

BackendKind gpio_backend() {
  // Its section holds the lines of any rig, too: `read_rig` reads and writes it.
  return {"gpio", nullptr, nullptr, make_gpio_encoders};
}

}  // namespace upright
