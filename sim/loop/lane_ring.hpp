// The last values of a signal of each lane. Lanes go on in step, or each at its own pace.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "lanes.hpp"

namespace upright {

/// `Mask`: EveryLane, or LaneMask where some lanes may go on while others wait.
template <class Mask>
class LaneRing {
 public:
  using Periods = std::array<std::uint32_t, lane_count>;

  /// Keeps values up to `longest` periods old.
  explicit LaneRing(std::size_t longest) : values_(std::bit_ceil(longest + 2) * lane_count) {}

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
      newest_ = (newest_ + stride) & wrap();
      value.store(&values_[newest_]);
    } else {
      // In loops of their own, of which all but the writes become vector instructions. A lane that waits
      // writes too, to the place of its next value.
      const std::uint32_t bits = lanes.bits();
      const auto numbers = value.values();
      Places next;
      for (std::size_t i = 0; i < lane_count; ++i) next[i] = (newest_[i] + stride) & wrap();
      for (std::size_t i = 0; i < lane_count; ++i) values_[next[i]] = numbers[i];
      for (std::size_t i = 0; i < lane_count; ++i) newest_[i] = (bits >> i & 1u) != 0 ? next[i] : newest_[i];
    }
  }

  /// The values of some periods ago; 0: the newest.
  Lanes ago(std::uint32_t periods) const {
    if constexpr (in_step) return Lanes::load(&values_[(newest_ - periods * stride) & wrap()]);
    Periods all;
    all.fill(periods);
    return ago(all);
  }
  /// The same with a number of periods for each lane, and as many `more`.
  Lanes ago(const Periods& periods, std::uint32_t more = 0) const {
    Places places;
    for (std::size_t i = 0; i < lane_count; ++i)
      places[i] = (newest_of(i) - (periods[i] + more) * stride) & wrap();
    return Lanes::gather(values_.data(), places);
  }

 private:
  static constexpr bool in_step = std::is_same_v<Mask, EveryLane>;
  using Places = std::array<std::uint32_t, lane_count>;
  static constexpr std::uint32_t stride = lane_count;
  static_assert(std::has_single_bit(lane_count), "places of a lane stay in it when they wrap around");

  std::uint32_t wrap() const { return static_cast<std::uint32_t>(values_.size() - 1); }
  std::uint32_t newest_of(std::size_t lane) const {
    if constexpr (in_step)
      return newest_ + static_cast<std::uint32_t>(lane);
    else
      return newest_[lane];
  }
  static auto first_places() {
    if constexpr (in_step) {
      return std::uint32_t{0};
    } else {
      Places places;
      for (std::size_t i = 0; i < lane_count; ++i) places[i] = static_cast<std::uint32_t>(i);
      return places;
    }
  }

  std::vector<double> values_;
  /// Places of the newest values: of the first lane if they are in step, of each otherwise.
  std::conditional_t<in_step, std::uint32_t, Places> newest_ = first_places();
};

}  // namespace upright
