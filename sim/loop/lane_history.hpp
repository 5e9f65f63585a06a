// Dense output of the feedback signal of `lane_count` continuous loops, each with its own time: a
// polynomial of order 4 per step (the continuous extension of Dormand and Prince's method: Hairer,
// Norsett, Wanner, Solving Ordinary Differential Equations I, II.6).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "lanes.hpp"

namespace upright {

class LaneHistory {
 public:
  /// c0 + u (c1 + (1 - u) (c2 + u (c3 + (1 - u) c4))), with u from 0 to 1 over a step.
  using Polynomial = std::array<Lanes, 5>;

  LaneHistory() : ring_(lane_count * slots_ * fields) { piece_.fill({}); }

  /// Restarts a lane: before `time_s` the signal is constant, `value`.
  void start(std::size_t lane, double time_s, double value) {
    count_[lane] = oldest_[lane] = 0;
    before_end_s_[lane] = time_s;
    before_[lane] = value;
    show_before(lane);
  }

  /// A lane without delay, whose history is not used.
  void start_without(std::size_t lane) { start(lane, always_s, 0.0); }

  /// Appends a step of some lanes.
  void add(std::uint32_t lanes, const Lanes& begin_s, const Lanes& end_s, const Lanes& per_step,
           const Polynomial& polynomial) {
    std::array<std::array<double, lane_count>, fields> values;
    begin_s.store(values[0].data());
    end_s.store(values[1].data());
    per_step.store(values[2].data());
    for (std::size_t k = 0; k < polynomial.size(); ++k) polynomial[k].store(values[3 + k].data());
    for (; lanes != 0; lanes &= lanes - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(lanes));
      if (before_end_s_[lane] == always_s) continue;
      if (count_[lane] - oldest_[lane] + 2 >= slots_) grow();
      double* step = step_of(lane, count_[lane]++);
      for (std::size_t k = 0; k < fields; ++k) step[k] = values[k][lane];
    }
  }

  /// The signal at one time per lane, at most the end of its last step.
  Lanes at(const Lanes& time_s) {
    const Lanes begin = Lanes::load(piece_[0].data()), end = Lanes::load(piece_[1].data());
    const LaneMask elsewhere = (time_s > end) | (time_s < begin);
    if (any(elsewhere)) {
      const auto times = time_s.values();
      for (std::uint32_t lanes = elsewhere.bits(); lanes != 0; lanes &= lanes - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(lanes));
        find(lane, times[lane]);
      }
    }
    const auto field = [this](std::size_t k) { return Lanes::load(piece_[k].data()); };
    const Lanes u = (time_s - field(0)) * field(2), rest = Lanes(1.0) - u;
    return field(3) + u * (field(4) + rest * (field(5) + u * (field(6) + rest * field(7))));
  }

  /// Discards the history before `time_s`.
  void forget_before(std::size_t lane, double time_s) {
    while (oldest_[lane] + 1 < count_[lane] && step_of(lane, oldest_[lane])[1] < time_s) ++oldest_[lane];
  }

 private:
  static constexpr std::size_t fields = 8;  // begin, end, 1 / step, polynomial: one cache line
  static constexpr double always_s = 1e300;

  double* step_of(std::size_t lane, std::uint64_t number) {
    return &ring_[(lane * slots_ + (number & (slots_ - 1))) * fields];
  }

  void show_before(std::size_t lane) {
    shown_[lane] = -1;
    const std::array<double, fields> values{-always_s, before_end_s_[lane], 0.0, before_[lane]};
    for (std::size_t k = 0; k < fields; ++k) piece_[k][lane] = values[k];
  }

  void find(std::size_t lane, double time_s) {
    if (count_[lane] == 0 || time_s <= before_end_s_[lane]) return show_before(lane);
    const auto last = static_cast<std::int64_t>(count_[lane]) - 1;
    const auto first = static_cast<std::int64_t>(oldest_[lane]);
    std::int64_t& at = shown_[lane];
    at = std::clamp(at, first, last);
    while (at < last && step_of(lane, static_cast<std::uint64_t>(at))[1] < time_s) ++at;
    while (at > first && step_of(lane, static_cast<std::uint64_t>(at))[0] > time_s) --at;
    const double* step = step_of(lane, static_cast<std::uint64_t>(at));
    for (std::size_t k = 0; k < fields; ++k) piece_[k][lane] = step[k];
  }

  void grow() {
    std::vector<double> larger(2 * ring_.size());
    for (std::size_t lane = 0; lane < lane_count; ++lane)
      for (std::uint64_t n = oldest_[lane]; n < count_[lane]; ++n)
        std::copy_n(step_of(lane, n), fields, &larger[(lane * 2 * slots_ + (n & (2 * slots_ - 1))) * fields]);
    ring_.swap(larger);
    slots_ *= 2;
  }

  std::size_t slots_ = 64;  // a power of two
  std::vector<double> ring_;
  std::array<std::uint64_t, lane_count> count_{}, oldest_{};
  std::array<std::int64_t, lane_count> shown_{};
  std::array<double, lane_count> before_end_s_{}, before_{};
  /// The step that was evaluated last, by lane, in the layout that `at` needs.
  std::array<std::array<double, lane_count>, fields> piece_;
};

}  // namespace upright
