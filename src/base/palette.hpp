// The colours of all pages and plots. Each colour has one meaning: stable is green,
// oscillating orange, a fall red; no other curve uses these. Colour-blind readers can
// distinguish the hues (after Okabe and Ito), and texts have a contrast of at least 4.5 on
// white.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

namespace upright::color {

// Outcomes.
inline constexpr std::string_view stable = "#009e73", oscillating = "#e69f00", fell = "#c1272d";

// Quantities of a run.
inline constexpr std::string_view cart = "#0b62c4", angle = "#b0307f", voltage = "#5b4b8a",
                                  requested = "#8fb4dc";

// A model before and after an addition, over the measurement.
inline constexpr std::string_view measured = "#1d2733", before = "#b0307f", after = "#0b62c4";

// Text, lines and grounds.
inline constexpr std::string_view ink = "#1d2733", soft = "#5a6775", line = "#d8dee6", grid = "#e3e8ee",
                                  band = "#d6e6f2", ground = "#eef1f5";

// Severity of a message: the edge of its box and the background.
inline constexpr std::string_view good = "#00795a", good_ground = "#eaf6f2", warning = "#9a6500",
                                  warning_ground = "#fdf5e4", bad = "#b3261e", bad_ground = "#fcecea",
                                  neutral = "#56708c", neutral_ground = "#eef2f6";

/// The k-th colour, cyclically, of curves without a colour of their own.
inline constexpr std::string_view curve(std::size_t k) {
  constexpr std::array<std::string_view, 6> cycle = {"#0b62c4", "#b0307f", "#4a5560",
                                                     "#3aa0d8", "#5b4b8a", "#8c6d5a"};
  return cycle[k % cycle.size()];
}

/// The colour of an outcome by its name; grey for any other.
inline constexpr std::string_view of_outcome(std::string_view outcome) {
  return outcome == "stable"        ? stable
         : outcome == "oscillating" ? oscillating
         : outcome == "fell"        ? fell
                                    : soft;
}

/// The colours as variables of a style sheet: `--stable` and so on.
inline std::string css_variables() {
  std::string text = ":root{";
  const auto add = [&](std::string_view name, std::string_view value) {
    text.append("--").append(name).append(":").append(value).append(";");
  };
  add("stable", stable);
  add("oscillating", oscillating);
  add("fell", fell);
  add("cart", cart);
  add("angle", angle);
  add("volt", voltage);
  add("ink", ink);
  add("soft", soft);
  add("line", line);
  add("grid", grid);
  add("ground", ground);
  add("good", good);
  add("good-ground", good_ground);
  add("wait", warning);
  add("wait-ground", warning_ground);
  add("bad", bad);
  add("bad-ground", bad_ground);
  add("neutral", neutral);
  add("neutral-ground", neutral_ground);
  return text + "}";
}

}  // namespace upright::color
