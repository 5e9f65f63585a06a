// The last values of a signal of each lane. Lanes go on in step, or each at its own pace.
#pragma once

#include <array>
#include <bit>
#include <type_traits>
#include <vector>

#include "lanes.hpp"

namespace upright {

/// `Mask`: EveryLane, or LaneMask where some lanes may go on while others wait.
template <class Mask>
class LaneRing {
 public:
  using Periods = std::array<std::size_t, lane_count>;

  /// Keeps values up to `longest` periods old.
  explicit LaneRing(std::size_t longest) : slots_(std::bit_ceil(longest + 2)), values_(slots_ * lane_count) {}

  /// All values of these lanes.
  void fill(const Mask& lanes, const Lanes& value) {
    if constexpr (in_step) {
      for (std::size_t i = 0; i < values_.size(); i += lane_count) value.store(&values_[i]);
    } else {
      const auto numbers = value.values();
      for (std::uint32_t bits = lanes.bits(); bits != 0; bits &= bits - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
        for (std::size_t i = lane; i < values_.size(); i += lane_count) values_[i] = numbers[lane];
      }
    }
  }

  /// Appends a value in these lanes.
  void push(const Mask& lanes, const Lanes& value) {
    if constexpr (in_step) {
      value.store(&values_[slot(++newest_, 0)]);
    } else {
      // A lane that waits writes too, to the place of its next value.
      const std::uint32_t bits = lanes.bits();
      const auto numbers = value.values();
      for (std::size_t i = 0; i < lane_count; ++i) {
        values_[slot(newest_[i] + 1, 0) + i] = numbers[i];
        newest_[i] += bits >> i & 1u;
      }
    }
  }

  /// The values of some periods ago; 0: the newest.
  Lanes ago(std::size_t periods) const {
    if constexpr (in_step) return Lanes::load(&values_[slot(newest_, periods)]);
    Periods all;
    all.fill(periods);
    return ago(all);
  }
  /// The same with a number of periods for each lane, and as many `more`.
  Lanes ago(const Periods& periods, std::size_t more = 0) const {
    std::array<double, lane_count> numbers;
    for (std::size_t i = 0; i < lane_count; ++i) {
      if constexpr (in_step)
        numbers[i] = values_[slot(newest_, periods[i] + more) + i];
      else
        numbers[i] = values_[slot(newest_[i], periods[i] + more) + i];
    }
    return Lanes::load(numbers.data());
  }

 private:
  static constexpr bool in_step = std::is_same_v<Mask, EveryLane>;

  std::size_t slot(std::size_t newest, std::size_t periods) const {
    return ((newest - periods) & (slots_ - 1)) * lane_count;
  }

  std::size_t slots_;
  std::vector<double> values_;
  std::conditional_t<in_step, std::size_t, Periods> newest_{};
};

}  // namespace upright
