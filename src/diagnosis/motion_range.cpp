#include "motion_range.hpp"

#include <algorithm>
#include <array>

#include "base/number_text.hpp"

namespace upright {

namespace {

/// Extends the range of a quantity by these values.
void extend(std::vector<QuantityRange>& ranges, const char* quantity, const char* unit,
            const std::vector<double>& values) {
  if (values.empty()) return;
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const auto known = std::find_if(ranges.begin(), ranges.end(),
                                  [&](const QuantityRange& range) { return range.quantity == quantity; });
  if (known == ranges.end()) {
    ranges.push_back({quantity, unit, *low, *high});
    return;
  }
  known->low = std::min(known->low, *low);
  known->high = std::max(known->high, *high);
}

std::vector<double> speeds_of(const std::vector<double>& values, const Measurement& run, double window_s) {
  std::vector<double> speeds;
  const auto stride = std::max<std::size_t>(1, static_cast<std::size_t>(window_s / run.median_period_s()));
  for (std::size_t k = stride; k < values.size(); k += stride)
    speeds.push_back((values[k] - values[k - stride]) / (run.time_s[k] - run.time_s[k - stride]));
  return speeds;
}

}  // namespace

std::vector<QuantityRange> motion_range(const std::vector<Measurement>& runs, double speed_window_s) {
  std::vector<QuantityRange> ranges;
  for (const Measurement& run : runs) {
    extend(ranges, "cart_m", "m", run.cart_m);
    extend(ranges, "cart_mps", "m/s", speeds_of(run.cart_m, run, speed_window_s));
    extend(ranges, "theta_rad", "rad", run.theta_rad);
    extend(ranges, "theta_radps", "rad/s", speeds_of(run.theta_rad, run, speed_window_s));
    if (!run.cart_locked) extend(ranges, "voltage_v", "V", run.voltage_v);
  }
  return ranges;
}

std::vector<QuantityRange> beyond_range(const std::vector<QuantityRange>& run,
                                        const std::vector<QuantityRange>& fitted) {
  constexpr double slack = 0.1;  // of the width: the ends are single samples
  std::vector<QuantityRange> beyond;
  for (const QuantityRange& range : run) {
    const auto known = std::find_if(fitted.begin(), fitted.end(), [&](const QuantityRange& other) {
      return other.quantity == range.quantity;
    });
    if (known == fitted.end()) continue;
    const double margin = slack * (known->high - known->low);
    if (range.low < known->low - margin || range.high > known->high + margin) beyond.push_back(range);
  }
  return beyond;
}

std::string range_text(const std::vector<QuantityRange>& ranges) {
  std::string text;
  for (const QuantityRange& range : ranges)
    text += (text.empty() ? "" : ", ") + range.quantity + " " + brief_text(range.low) + " to " +
            brief_text(range.high) + " " + range.unit;
  return text;
}

}  // namespace upright
