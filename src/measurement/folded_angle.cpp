#include "folded_angle.hpp"

#include <algorithm>
#include <cmath>

namespace upright {

namespace {

/// A jump is no smaller a share of the range; what an angle turns within a row is the rest.
constexpr double min_of_range = 0.8;
/// Nor do jumps differ by more than this share of the largest, when the motion before and after is taken off.
constexpr double max_difference = 0.1;
/// At a mirror the rate is no smaller a share of the largest, and the same after as before within this.
constexpr double min_rate = 0.1, same_rate = 0.35;

struct Extremes {
  double smallest, largest;
};

Extremes extremes_of(const std::vector<double>& values) {
  const auto [smallest, largest] = std::minmax_element(values.begin(), values.end());
  return {*smallest, *largest};
}

}  // namespace

std::optional<double> find_fold(const std::vector<double>& values,
                                const std::function<bool(std::size_t)>& gap_before) {
  if (values.size() < 4) return std::nullopt;
  const auto [smallest, largest] = extremes_of(values);
  std::vector<double> jumps;
  for (std::size_t k = 2; k + 1 < values.size(); ++k) {
    const double step = values[k] - values[k - 1];
    if (std::abs(step) < min_of_range * (largest - smallest) || step == 0.0 || gap_before(k)) continue;
    const double before = values[k - 1] - values[k - 2], after = values[k + 1] - values[k];
    // A row that is off jumps and jumps back.
    if (std::max(std::abs(before), std::abs(after)) > 0.5 * std::abs(step)) continue;
    jumps.push_back(std::abs(step - 0.5 * (before + after)));
  }
  if (jumps.empty()) return std::nullopt;
  std::sort(jumps.begin(), jumps.end());
  if (jumps.back() - jumps.front() > max_difference * jumps.back()) return std::nullopt;
  return jumps[jumps.size() / 2];
}

void unfold(std::vector<double>& values, double every) {
  double added = 0.0;
  for (std::size_t k = 1; k < values.size(); ++k) {
    added -= every * std::round((values[k] + added - values[k - 1]) / every);
    values[k] += added;
  }
}

std::size_t unmirror(std::vector<double>& values) {
  constexpr std::size_t reach = 3;  // rows over which a rate is taken
  if (values.size() < 2 * reach + 2) return 0;
  const std::vector<double> seen = values;
  const auto [smallest, largest] = extremes_of(seen);
  const auto rate = [&](std::size_t from) {
    return (seen[from + reach] - seen[from]) / static_cast<double>(reach);
  };
  double fastest = 0.0;
  for (std::size_t k = 0; k + reach < seen.size(); ++k) fastest = std::max(fastest, std::abs(rate(k)));
  std::size_t mirrors = 0, last = 0;
  double turned = 1.0, added = 0.0;  // values are turned x seen + added
  for (std::size_t k = 0; k < seen.size(); ++k) {
    if (k >= reach + 1 && k + reach < seen.size() && k > last + reach) {
      const double before = rate(k - 1 - reach), after = rate(k);
      const double slower = std::min(std::abs(before), std::abs(after));
      const bool turns = before * after < 0.0 && slower > min_rate * fastest &&
                         std::abs(before + after) < same_rate * (std::abs(before) + std::abs(after));
      const double end = before < 0.0 ? smallest : largest;
      if (turns && std::abs(seen[k] - end) <= 1.5 * slower && std::abs(seen[k - 1] - end) <= 1.5 * slower) {
        added += 2.0 * turned * end;
        turned = -turned;
        last = k;
        ++mirrors;
      }
    }
    values[k] = turned * seen[k] + added;
  }
  return mirrors;
}

}  // namespace upright
