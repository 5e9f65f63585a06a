// Delay compensation by lane: the feedback of the predicted state, each lane with its own delay.
//
// A prediction is a sum over the voltages on their way, one term for each period of the delay. All lanes get
// it by a recursion: what the voltages add to the predicted state goes through a step of the model each
// period; the newest voltage is added and the oldest taken away.
//
// What is taken away cancels what was added but for rounding, which an unstable plant amplifies for ever. So
// there are two parts: one takes voltages in, the other gives the older ones away. After the periods of one
// delay the other is empty. Then what it has left is forgotten, and the first takes its place.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "control/kalman_step.hpp"
#include "control/predictor_step.hpp"
#include "lane_builds.hpp"
#include "lane_model.hpp"
#include "lane_ring.hpp"

namespace upright {

/// The feedback of what the voltages on their way add to the predicted state, by lane.
class LaneVoltages {
 public:
  /// `of`: any prediction that a lane may have. None has more than `longest` voltages on their way. Before
  /// the start all were `resting_v`.
  LaneVoltages(const FeedbackPrediction& of, std::size_t longest, const Lanes& resting_v)
      : step_(of.step), feedback_(of.freely), lags_(of.lags), resting_v_(resting_v), ring_(longest) {}

  /// Gives one lane this prediction.
  void take(std::size_t lane, const FeedbackPrediction& of) {
    const std::vector<double>& weights = of.on_their_way;
    periods_[lane] = static_cast<std::uint32_t>(weights.size() - 1);
    put(whole_, lane, static_cast<double>(periods_[lane]));
    put(oldest_, lane, weights.front());
    put(resting_feedback_v_, lane,
        resting_v_.values()[lane] * std::accumulate(weights.begin(), weights.end(), 0.0));
    for (std::size_t k = 0; k < leaving_.size(); ++k) put(leaving_[k], lane, of.leaving[k]);
  }

  void start(const LaneMask& lanes) {
    ring_.fill(lanes, resting_v_);
    forget(arriving_, lanes);
    forget(departing_, lanes);
    arrived_ = select(lanes, Lanes(0.0), arrived_);
  }

  /// The newest voltage in these lanes.
  void push(const LaneMask& lanes, const Lanes& drive_v) {
    ring_.push(lanes, drive_v);
    oldest_v_ = ring_.ago(periods_);
    replace_departed(lanes);
    const Lanes newest = drive_v - resting_v_, oldest = oldest_v_ - resting_v_;
    if (lags_)
      advance<filter_motor + 1>(lanes, newest, oldest);
    else
      advance<filter_motor>(lanes, newest, oldest);
    arrived_ = select(lanes, arrived_ + Lanes(1.0), arrived_);
  }

  Lanes feedback_v() const {
    Lanes sum = resting_feedback_v_ + oldest_ * (oldest_v_ - resting_v_);
    for (std::size_t k = 0; k < filter_motor; ++k)
      sum = sum + Lanes(feedback_[k]) * (arriving_[k] + departing_[k]);
    return sum;
  }

  /// The oldest voltage on its way, and the one before it.
  const Lanes& oldest_v() const { return oldest_v_; }
  Lanes before_v() const { return ring_.ago(periods_, 1); }

 private:
  using State = std::array<Lanes, predicted_states>;

  static void forget(State& part, const LaneMask& lanes) {
    for (Lanes& number : part) number = select(lanes, Lanes(0.0), number);
  }

  void replace_departed(const LaneMask& lanes) {
    const LaneMask departed = lanes & (arrived_ >= whole_);
    if (!any(departed)) return;
    // Of a delay below one period nothing stays that acts over a whole one.
    const LaneMask stays = whole_ > Lanes(0.0);
    for (std::size_t k = 0; k < arriving_.size(); ++k)
      departing_[k] = select(departed, select(stays, arriving_[k], Lanes(0.0)), departing_[k]);
    forget(arriving_, departed);
    arrived_ = select(departed, Lanes(0.0), arrived_);
  }

  /// Only the first `states` are not 0: no voltage moves the others.
  template <std::size_t states>
  void advance(const LaneMask& lanes, const Lanes& newest, const Lanes& oldest) {
    const State arriving = step_.freely<states>(arriving_), departing = step_.freely<states>(departing_);
    for (std::size_t k = 0; k < states; ++k) {
      arriving_[k] = select(lanes, arriving[k] + Lanes(step_.b[k]) * newest, arriving_[k]);
      departing_[k] = select(lanes, departing[k] - leaving_[k] * oldest, departing_[k]);
    }
  }

  PredictorStep step_;
  FeedbackPrediction::Row feedback_;
  bool lags_;
  Lanes resting_v_;
  LaneRing<LaneMask> ring_;
  std::array<std::uint32_t, lane_count> periods_{};
  Lanes whole_;               ///< the same
  Lanes oldest_;              ///< feedback per volt of the oldest, which acts over a part of a period
  Lanes resting_feedback_v_;  ///< while all are `resting_v_`
  State leaving_;             ///< of FeedbackPrediction
  /// What the voltages of whole periods add to the predicted state, less what resting ones do.
  State arriving_, departing_;
  Lanes arrived_;  ///< how many voltages
  Lanes oldest_v_;
};

/// The prediction of Predictor or EstimatePredictor (src/control), which have the reasons.
class LanePredictor {
 public:
  using State = std::array<Lanes, predicted_states>;

  /// `of`: any prediction that a lane may have. No delay has more periods than `longest_periods`.
  LanePredictor(const PlantModel<double>& model, const FeedbackPrediction& of, double longest_periods)
      : common_(of),
        actuator_(on_lanes(model)),
        resting_v_(actuator_.actuate(Lanes(0.0))),
        voltages_(of, most_weights(of, longest_periods), resting_v_),
        filters_(of.filter.m1 != 0.0 || of.filter.m0 != 0.0) {}

  /// Gives one lane this prediction.
  void take(std::size_t lane, const FeedbackPrediction& of) {
    voltages_.take(lane, of);
    filters_ = filters_ || of.now != 0.0;
    for (std::size_t k = 0; k < predicted_states; ++k) put(known_[k], lane, of.known[k]);
    put(constant_v_, lane, of.constant_v);
    put(now_, lane, of.now);
    put(next_, lane, of.next);
    put(motor_, lane, of.motor);
    put(fraction_, lane, of.fraction);
    put(free_periods_, lane, static_cast<double>(of.free_periods));
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
    voltages_.start(lanes);
    const VoltageFilter::State<Lanes> settled = common_.filter.started(resting_v_);
    filtered_ = {select(lanes, settled.now, filtered_.now), select(lanes, settled.next, filtered_.next),
                 select(lanes, settled.motor, filtered_.motor)};
    State led = held;
    if (common_.lags) led[filter_motor] = resting_v_;
    common_.lead.propagate(led, resting_v_);
    for (std::size_t k = 0; k < predicted_states; ++k) free_state_[k] = select(lanes, led[k], free_state_[k]);
    periods_ = select(lanes, Lanes(0.0), periods_);
  }

  /// The feedback of the predicted state in these lanes. `known`: `known_v` one delay ago; `applied_v`: the
  /// voltage held over the period that just ended.
  Lanes feedback_v(const LaneMask& lanes, const Lanes& known, const Lanes& applied_v) {
    const Lanes drive_v = actuator_.actuate(applied_v);
    voltages_.push(lanes, drive_v);
    if (filters_) filter(lanes);
    const Lanes predicted_v = (known + constant_v_) +
                              (now_ * filtered_.now + next_ * filtered_.next + motor_ * filtered_.motor) +
                              voltages_.feedback_v();
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
    const Lanes late = voltages_.oldest_v(), early = voltages_.before_v();
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
  Lanes resting_v_;
  LaneVoltages voltages_;
  State known_, free_state_;
  Lanes constant_v_, now_, next_, motor_, fraction_, free_periods_, periods_;
  VoltageFilter::State<Lanes> filtered_;
  bool filters_;
};

}  // namespace upright
