#include "column_timing.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace upright {

namespace {

/// Less is within what sensors that are read one after the other have.
constexpr double min_lateness_s = 0.004;
/// An equation leaves so much at least as the columns are, and no more once they are moved.
constexpr double min_left_by_angle = 0.003, min_left_by_voltage = 0.01, max_left_at_best = 0.3;
/// It leaves so many times less then; or fewer times, but in each third of the record.
constexpr double far_less = 5.0, less = 2.5, less_in_each_third = 1.5;
/// A cart column that is late shows in both equations: together they gain as much, each by so much at least,
/// and they agree on the time within this share of it.
constexpr double less_in_each_equation = 1.5, agreement = 0.3;

double gain(const Lateness& l) {
  return l.left / std::max(l.left_at_best, 1e-9);
}

bool is_certain(const std::optional<Lateness>& l, double min_left) {
  return l && std::abs(l->later_s) >= min_lateness_s && l->left >= min_left &&
         l->left_at_best <= max_left_at_best &&
         (gain(*l) >= far_less || (gain(*l) >= less && l->min_gain >= less_in_each_third));
}

bool both_say_cart(const std::optional<Lateness>& angle, const std::optional<Lateness>& voltage) {
  return angle && voltage && angle->later_s <= -min_lateness_s && voltage->later_s >= min_lateness_s &&
         std::abs(angle->later_s + voltage->later_s) <=
             std::max(min_lateness_s, agreement * voltage->later_s) &&
         std::min(gain(*angle), gain(*voltage)) >= less_in_each_equation &&
         gain(*angle) * gain(*voltage) >= far_less &&
         std::max(angle->left, voltage->left) >= min_left_by_voltage &&
         std::max(angle->left_at_best, voltage->left_at_best) <= max_left_at_best;
}

void add(DataReading& reading, Channel channel, double later_s, const char* format) {
  char words[160];
  std::snprintf(words, sizeof words, format, 1e3 * later_s);
  reading.later_s[channel] += later_s;
  reading.mistakes.emplace_back(words);
}

}  // namespace

std::optional<DataReading> with_lateness(const ReadingJudge& judge, DataReading reading) {
  const std::size_t said = reading.mistakes.size();
  const auto angle = judge.lateness_of_angle(reading);
  auto voltage = judge.lateness_of_voltage(reading);
  const bool by_angle = is_certain(angle, min_left_by_angle);
  if (by_angle && angle->later_s > 0.0) {
    add(reading, theta_channel, angle->later_s, "theta_rad is %.3g ms later than cart_m");
  } else if (by_angle || both_say_cart(angle, voltage)) {
    add(reading, cart_channel, -angle->later_s, "cart_m is %.3g ms later than theta_rad");
  }
  if (reading.mistakes.size() > said) voltage = judge.lateness_of_voltage(reading);
  if (is_certain(voltage, min_left_by_voltage) && voltage->later_s > 0.0)
    add(reading, voltage_channel, voltage->later_s,
        "voltage_v is %.3g ms later than the motion that it causes");
  if (reading.mistakes.size() == said) return std::nullopt;
  return reading;
}

}  // namespace upright
