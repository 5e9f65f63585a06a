// The few statistics that reports show.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

namespace upright {

struct Spread {
  double median = 0.0;
  double p99 = 0.0;
  double p999 = 0.0;
  double largest = 0.0;
};

/// Counts non-negative values. Memory grows with the number of different values, not with their count. Whole
/// numbers up to 65536 are counted separately; larger values have a relative resolution of 1/32768.
class ValueCounts {
 public:
  void add(std::int64_t value);
  /// All zero when nothing was counted.
  Spread spread() const;
  /// Values and their counts in ascending order. A group of values is represented by its largest.
  std::vector<std::pair<std::int64_t, std::uint64_t>> sorted() const;

 private:
  struct Group {
    std::int64_t largest = 0;
    std::uint64_t count = 0;
  };
  std::unordered_map<std::int64_t, Group> groups_;
};

/// Largest magnitude and root of the mean square of the finite values; 0 when there are none.
class Magnitude {
 public:
  void add(double value);
  double largest() const { return largest_; }
  double root_mean_square() const;

 private:
  double largest_ = 0.0, sum_ = 0.0;
  std::uint64_t count_ = 0;
};

}  // namespace upright
