#include "ticks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/number_text.hpp"

namespace upright {

namespace {

constexpr double gap_beside_px = 14.0;  // between two texts beside each other
constexpr double row_heights = 2.0;     // from one text to that above it
constexpr double tolerance = 1e-9;      // of a step, at an axis's ends

double place_px(const AxisSpan& axis, double value) {
  const auto on = [&](double v) { return axis.logarithmic ? std::log(v) : v; };
  return axis.length_px * (on(value) - on(axis.low)) / (on(axis.high) - on(axis.low));
}

/// Whether no text touches the next.
bool fit(const AxisSpan& axis, const std::vector<Tick>& ticks) {
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    const double apart = place_px(axis, ticks[i].at) - place_px(axis, ticks[i - 1].at);
    const double needed = axis.horizontal
                              ? gap_beside_px + 0.5 * (text_width_px(ticks[i].text, axis.text_px) +
                                                       text_width_px(ticks[i - 1].text, axis.text_px))
                              : row_heights * axis.text_px;
    if (apart < needed) return false;
  }
  return true;
}

std::string fixed(double value, double step) {
  const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + tolerance)));
  constexpr int max_decimals = 6;
  const double largest = 1e6;
  if (decimals > max_decimals || std::abs(value) >= largest) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", value);
    return text;
  }
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, std::abs(value) < tolerance * step ? 0.0 : value);
  return text;
}

std::vector<Tick> at_step(const AxisSpan& axis, double step) {
  std::vector<Tick> ticks;
  const double first = std::ceil(axis.low / step - tolerance),
               last = std::floor(axis.high / step + tolerance);
  constexpr double max_ticks = 2000.0;
  const int count = static_cast<int>(std::clamp(last - first + 1.0, 0.0, max_ticks));
  ticks.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) ticks.push_back({(first + i) * step, fixed((first + i) * step, step)});
  return ticks;
}

std::vector<Tick> linear(const AxisSpan& axis) {
  const double span = axis.high - axis.low;
  // From steps that are surely too close, up to the first that has room.
  for (double power = std::floor(std::log10(span)) - 2.0; power < std::log10(span) + 1.0; power += 1.0)
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double step = factor * std::pow(10.0, power);
      if (axis.whole && step < 1.0) continue;
      std::vector<Tick> ticks = at_step(axis, step);
      if (fit(axis, ticks)) return ticks;
    }
  return {};
}

/// At the given multiples of each `every`-th power of ten.
std::vector<Tick> in_decades(const AxisSpan& axis, const std::vector<double>& multiples, int every) {
  std::vector<Tick> ticks;
  const auto low = static_cast<int>(std::floor(std::log10(axis.low)));
  const auto high = static_cast<int>(std::ceil(std::log10(axis.high)));
  for (int power = low; power <= high; ++power)
    for (const double multiple : multiples) {
      const double at = multiple * std::pow(10.0, power);
      const bool inside = at >= axis.low * (1.0 - tolerance) && at <= axis.high * (1.0 + tolerance);
      if (power % every == 0 && inside && !(axis.whole && at < 1.0)) {
        char text[32];
        std::snprintf(text, sizeof text, "%.4g", at);
        ticks.push_back({at, std::abs(power) <= 4 ? number_text(at) : text});
      }
    }
  return ticks;
}

std::vector<Tick> logarithmic(const AxisSpan& axis) {
  constexpr std::size_t enough = 3;
  for (const std::vector<double>& multiples :
       {std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8, 9}, {1, 2, 3, 5}, {1, 2, 5}, {1, 3}, {1}}) {
    std::vector<Tick> ticks = in_decades(axis, multiples, 1);
    if (ticks.size() >= enough && fit(axis, ticks)) return ticks;
  }
  for (const int every : {2, 3, 5, 10, 20, 50}) {
    std::vector<Tick> ticks = in_decades(axis, {1}, every);
    if (ticks.size() >= enough && fit(axis, ticks)) return ticks;
  }
  return linear(axis);
}

}  // namespace

double text_width_px(const std::string& text, double text_px) {
  constexpr double character_part = 0.62;  // of the height, in a sans-serif
  double characters = 0.0;
  for (const char c : text) characters += (static_cast<unsigned char>(c) & 0xc0u) != 0x80u ? 1.0 : 0.0;
  return character_part * text_px * characters;
}

std::vector<Tick> ticks_of(const AxisSpan& axis) {
  if (!(axis.high > axis.low)) return {};
  return axis.logarithmic ? logarithmic(axis) : linear(axis);
}

}  // namespace upright
