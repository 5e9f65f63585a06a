// Delay compensation by lane: the feedback of the predicted state, each lane with its own delay.
//
// The prediction is a sum over the voltages on their way, and so is its feedback, with one weight for each of
// them. Each lane adds up its own: its voltages and weights are contiguous, so that registers hold
// consecutive periods there.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <vector>

#include "control/predictor_step.hpp"
#include "lane_builds.hpp"
#include "lane_model.hpp"

namespace upright {

/// A weighted sum of the last voltages, by lane.
class LaneWindow {
 public:
  /// For up to so many weights. What `ago` looks back at is one older than the weights, and a lane that waits
  /// writes to one more place.
  explicit LaneWindow(std::size_t longest)
      : slots_(std::bit_ceil(whole_registers(longest) + 2)), values_(lane_count * 2 * slots_) {}

  /// The weights of one lane, oldest first.
  void weigh(std::size_t lane, const std::vector<double>& weights) {
    // Whole registers, so that the order of the sum depends on this lane alone.
    length_[lane] = whole_registers(weights.size());
    weights_[lane].assign(length_[lane] - weights.size(), 0.0);
    weights_[lane].insert(weights_[lane].end(), weights.begin(), weights.end());
  }

  /// All values of these lanes (bit i: lane i).
  void fill(std::uint32_t lanes, const Lanes& value) {
    const auto numbers = value.values();
    for (; lanes != 0; lanes &= lanes - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(lanes));
      std::fill_n(values_.begin() + static_cast<std::ptrdiff_t>(i * 2 * slots_), 2 * slots_, numbers[i]);
    }
  }

  /// Appends a value in these lanes (bit i: lane i). A lane that waits writes to the place of its next value.
  void push(std::uint32_t lanes, const Lanes& value) {
    const auto numbers = value.values();
    for (std::size_t i = 0; i < lane_count; ++i) {
      const std::size_t at = i * 2 * slots_ + ((newest_[i] + 1) & (slots_ - 1));
      values_[at] = values_[at + slots_] = numbers[i];
      newest_[i] += lanes >> i & 1u;
    }
  }

  Lanes sum() const {
    std::array<double, lane_count> sums;
    for (std::size_t i = 0; i < lane_count; ++i) {
      const double* value = last(i) + 1 - length_[i];
      const double* weight = weights_[i].data();
      Lanes::Batch sum(0.0);
      for (std::size_t k = 0; k < length_[i]; k += together)
        sum = xsimd::fma(Lanes::Batch::load_unaligned(weight + k), Lanes::Batch::load_unaligned(value + k),
                         sum);
      sums[i] = xsimd::hadd(sum);
    }
    return Lanes::load(sums.data());
  }

  /// The values before the newest by these numbers of periods.
  Lanes ago(const std::array<std::size_t, lane_count>& periods) const {
    std::array<double, lane_count> numbers;
    for (std::size_t i = 0; i < lane_count; ++i) numbers[i] = *(last(i) - periods[i]);
    return Lanes::load(numbers.data());
  }

 private:
  static constexpr std::size_t together = Lanes::Batch::size;

  static std::size_t whole_registers(std::size_t weights) {
    return (weights + together - 1) / together * together;
  }
  /// Of each value there are two copies, so that `slots_` values before this one are contiguous.
  const double* last(std::size_t lane) const {
    return &values_[lane * 2 * slots_ + slots_ + (newest_[lane] & (slots_ - 1))];
  }

  std::size_t slots_;
  std::vector<double> values_;
  std::array<std::vector<double>, lane_count> weights_;
  std::array<std::size_t, lane_count> length_{}, newest_{};
};

/// The prediction of Predictor or EstimatePredictor (src/control), which have the reasons.
class LanePredictor {
 public:
  using State = std::array<Lanes, predicted_states>;

  /// `of`: any prediction that a lane may have. No delay has more periods than `longest_periods`.
  LanePredictor(const PlantModel<double>& model, const FeedbackPrediction& of, double longest_periods)
      : common_(of),
        actuator_(on_lanes(model)),
        window_(most_weights(of, longest_periods)),
        filters_(of.filter.m1 != 0.0 || of.filter.m0 != 0.0) {}

  /// Gives one lane this prediction.
  void take(std::size_t lane, const FeedbackPrediction& of) {
    window_.weigh(lane, of.on_their_way);
    filters_ = filters_ || of.now != 0.0;
    for (std::size_t k = 0; k < predicted_states; ++k) put(known_[k], lane, of.known[k]);
    put(constant_v_, lane, of.constant_v);
    put(now_, lane, of.now);
    put(next_, lane, of.next);
    put(motor_, lane, of.motor);
    put(fraction_, lane, of.fraction);
    put(free_periods_, lane, static_cast<double>(of.free_periods));
    oldest_[lane] = of.on_their_way.size() - 1;
    before_[lane] = oldest_[lane] + 1;
  }

  /// The true states that sensors and velocity estimates show.
  State shown(const Lanes& cart, const Lanes& pendulum, const Lanes& cart_rate,
              const Lanes& pendulum_rate) const {
    const Lanes cart_scale(1.0 / common_.scale[0]), angle_scale(1.0 / common_.scale[1]);
    return {(cart - Lanes(common_.offset[0])) * cart_scale,
            (pendulum - Lanes(common_.offset[1])) * angle_scale, cart_rate * cart_scale,
            pendulum_rate * angle_scale};
  }

  /// What a state adds to the feedback one delay later.
  Lanes known_v(const State& state) const {
    Lanes sum = known_[0] * state[0];
    for (std::size_t k = 1; k < predicted_states; ++k) sum = sum + known_[k] * state[k];
    return sum;
  }

  void start(const LaneMask& lanes, const State& held) {
    const Lanes resting = actuator_.actuate(Lanes(0.0));
    window_.fill(lanes.bits(), resting);
    const VoltageFilter::State<Lanes> settled = common_.filter.started(resting);
    filtered_ = {select(lanes, settled.now, filtered_.now), select(lanes, settled.next, filtered_.next),
                 select(lanes, settled.motor, filtered_.motor)};
    State led = held;
    if (common_.lags) led[filter_motor] = resting;
    common_.lead.propagate(led, resting);
    for (std::size_t k = 0; k < predicted_states; ++k) free_state_[k] = select(lanes, led[k], free_state_[k]);
    periods_ = select(lanes, Lanes(0.0), periods_);
  }

  /// The feedback of the predicted state in these lanes. `known`: `known_v` one delay ago; `applied_v`: the
  /// voltage held over the period that just ended.
  Lanes feedback_v(const LaneMask& lanes, const Lanes& known, const Lanes& applied_v) {
    const Lanes drive_v = actuator_.actuate(applied_v);
    window_.push(lanes.bits(), drive_v);
    if (filters_) filter(lanes);
    const Lanes predicted_v = (known + constant_v_) +
                              (now_ * filtered_.now + next_ * filtered_.next + motor_ * filtered_.motor) +
                              window_.sum();
    const LaneMask free = periods_ < free_periods_;
    periods_ = select(lanes, periods_ + Lanes(1.0), periods_);
    return any(free & lanes) ? select(free, go_free(free & lanes, drive_v), predicted_v) : predicted_v;
  }

 private:
  /// One for each period that a delay is longer than that of `of`, which has `free_periods`, rounded up.
  static std::size_t most_weights(const FeedbackPrediction& of, double longest_periods) {
    const double longer = std::ceil(longest_periods) - static_cast<double>(of.free_periods);
    return of.on_their_way.size() + 1 + static_cast<std::size_t>(std::max(longer, 0.0));
  }

  void filter(const LaneMask& lanes) {
    const Lanes late = window_.ago(oldest_), early = window_.ago(before_);
    VoltageFilter::State<Lanes> next = filtered_;
    common_.filter.take(next, (Lanes(1.0) - fraction_) * late + fraction_ * early);
    filtered_ = {select(lanes, next.now, filtered_.now), select(lanes, next.next, filtered_.next),
                 select(lanes, next.motor, filtered_.motor)};
  }

  Lanes go_free(const LaneMask& lanes, const Lanes& drive_v) {
    State next = free_state_;
    common_.step.propagate(next, drive_v);
    Lanes sum(common_.freely_constant_v);
    for (std::size_t k = 0; k < predicted_states; ++k) {
      free_state_[k] = select(lanes, next[k], free_state_[k]);
      sum = sum + Lanes(common_.freely[k]) * free_state_[k];
    }
    return sum;
  }

  FeedbackPrediction common_;  ///< but for the numbers by lane
  Dynamics<Lanes> actuator_;
  LaneWindow window_;
  State known_, free_state_;
  Lanes constant_v_, now_, next_, motor_, fraction_, free_periods_, periods_;
  VoltageFilter::State<Lanes> filtered_;
  std::array<std::size_t, lane_count> oldest_{}, before_{};
  bool filters_;
};

}  // namespace upright
