#include "statistics.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace upright {

namespace {

/// Values of one group agree in their leading bits.
std::int64_t group_of(std::int64_t value) {
  constexpr int exact_bits = 16;
  const int bits = std::bit_width(static_cast<std::uint64_t>(value));
  const int dropped = std::max(0, bits - exact_bits);
  return value >> dropped << dropped;
}

}  // namespace

void ValueCounts::add(std::int64_t value) {
  Group& group = groups_[group_of(std::max<std::int64_t>(0, value))];
  group.largest = std::max(group.largest, value);
  ++group.count;
}

std::vector<std::pair<std::int64_t, std::uint64_t>> ValueCounts::sorted() const {
  std::vector<std::pair<std::int64_t, std::uint64_t>> values;
  values.reserve(groups_.size());
  for (const auto& [start, group] : groups_) values.emplace_back(group.largest, group.count);
  std::sort(values.begin(), values.end());
  return values;
}

Spread ValueCounts::spread() const {
  const auto values = sorted();
  if (values.empty()) return {};
  double count = 0.0;
  for (const auto& [value, times] : values) count += static_cast<double>(times);
  const auto quantile = [&](double p) {
    const double rank = std::max(1.0, std::ceil(p * count));
    double seen = 0.0;
    for (const auto& [value, times] : values)
      if ((seen += static_cast<double>(times)) >= rank) return static_cast<double>(value);
    return static_cast<double>(values.back().first);
  };
  return {quantile(0.5), quantile(0.99), quantile(0.999), static_cast<double>(values.back().first)};
}

void Magnitude::add(double value) {
  if (!std::isfinite(value)) return;
  largest_ = std::max(largest_, std::abs(value));
  sum_ += value * value;
  ++count_;
}

double Magnitude::root_mean_square() const {
  return count_ > 0 ? std::sqrt(sum_ / static_cast<double>(count_)) : 0.0;
}

}  // namespace upright
