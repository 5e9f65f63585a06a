// What the controllers of sampled loops know of their plants, by lane: encoders with the velocity estimator,
// or with a stationary Kalman filter; and predictors of the delay.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "lane_builds.hpp"
#include "lane_model.hpp"
#include "lane_predictor.hpp"
#include "lane_ring.hpp"
#include "loop_run.hpp"
#include "upright/control/velocity_estimator.hpp"

namespace upright {

/// Encoders and velocity estimate of one coordinate.
class LaneSensor {
 public:
  LaneSensor(const EstimatorStep& step, double resolution) : step_(step), resolution_(resolution) {}

  template <class Mask>
  void start(const Mask& lanes, const Lanes& value) {
    position = select(lanes, stepped(value), position);
    previous_ = select(lanes, position, previous_);
    velocity = select(lanes, Lanes(0.0), velocity);
    lag_ = select(lanes, Lanes(0.0), lag_);
  }

  template <class Mask>
  void take(const Mask& lanes, const Lanes& value) {
    position = select(lanes, stepped(value), position);
    const Lanes dx = position - previous_;
    const Lanes next = Lanes(step_.p21) * lag_ + Lanes(step_.p22) * velocity + Lanes(step_.g2) * dx;
    lag_ = select(lanes, Lanes(step_.p11) * lag_ + Lanes(step_.p12) * velocity + Lanes(step_.g1) * dx, lag_);
    velocity = select(lanes, next, velocity);
    previous_ = position;
  }

  Lanes position, velocity;

 private:
  Lanes stepped(const Lanes& value) const {
    return resolution_ > 0.0 ? round(value * Lanes(1.0 / resolution_)) * Lanes(resolution_) : value;
  }

  EstimatorStep step_;
  double resolution_;
  Lanes previous_, lag_;
};

/// The filter of KalmanFilter (src/control), which has the reasons, while no reading is missing and no
/// pendulum turns over.
template <class Mask>
class LaneKalmanFilter {
 public:
  explicit LaneKalmanFilter(const LaneEstimator& estimator)
      : step_(estimator.step),
        actuator_(on_lanes(estimator.model)),
        drives_(estimator.step.input_periods + 1) {}

  void start(const Mask& lanes, const LaneSensor& cart, const LaneSensor& pendulum) {
    State begin{};
    const Lanes resting = actuator_.actuate(Lanes(0.0));
    drives_.fill(lanes, resting);
    if (step_.late[filter_motor] != 0.0) begin[filter_motor] = resting;
    begin[filter_cart] = step_.position_of(0, cart.position);
    begin[filter_theta] = step_.position_of(1, pendulum.position);
    for (std::size_t i = 0; i < begin.size(); ++i) state_[i] = select(lanes, begin[i], state_[i]);
  }

  void take(const Mask& lanes, const LaneSensor& cart, const LaneSensor& pendulum, const Lanes& applied_v) {
    drives_.push(lanes, actuator_.actuate(applied_v));
    State state = state_;
    step_.propagate(state, drives_.ago(step_.input_periods), drives_.ago(step_.input_periods + 1));
    const Lanes x = step_.position_of(0, cart.position), theta = step_.position_of(1, pendulum.position);
    step_.correct(state, x - state[filter_cart], theta - state[filter_theta] - state[filter_angle_zero]);
    const LaneMask far = absolute(theta) > Lanes(KalmanStep::linear_within_rad);
    if (any(far)) follow(state, far, x, theta, cart.velocity, pendulum.velocity);
    for (std::size_t i = 0; i < state.size(); ++i) state_[i] = select(lanes, state[i], state_[i]);
  }

  Lanes feedback(const Gains& gains) const {
    const auto shown = [this](std::ptrdiff_t state, std::size_t coordinate) {
      return Lanes(step_.scale[coordinate]) * state_[static_cast<std::size_t>(state)];
    };
    return Lanes(gains.cart_position_v_per_m) * shown(filter_cart, 0) +
           Lanes(gains.pendulum_angle_v_per_rad) * shown(filter_theta, 1) +
           Lanes(gains.cart_velocity_v_per_mps) * shown(filter_cart_velocity, 0) +
           Lanes(gains.pendulum_rate_v_per_radps) * shown(filter_pendulum_rate, 1) +
           step_.rejecting_v(Lanes(step_.share) * state_[filter_cart_force]);
  }
  /// The true states, for a prediction.
  LanePredictor::State estimate() const {
    return {state_[filter_cart],          state_[filter_theta],
            state_[filter_cart_velocity], state_[filter_pendulum_rate],
            state_[filter_motor],         Lanes(step_.share) * state_[filter_cart_force]};
  }
  Lanes command_v(const Lanes& wanted_v) const { return step_.command_v(wanted_v); }
  /// The voltage that cancels the known force alone.
  Lanes resting_v() const { return step_.rejecting_v(Lanes(0.0)); }

 private:
  using State = std::array<Lanes, filter_states>;

  void follow(State& state, const LaneMask& lanes, const Lanes& x, const Lanes& theta, const Lanes& shown_mps,
              const Lanes& shown_radps) const {
    const auto replace = [&](std::size_t of, const Lanes& value) {
      state[of] = select(lanes, value, state[of]);
    };
    replace(filter_cart, x);
    replace(filter_theta, theta);
    replace(filter_cart_velocity, shown_mps / Lanes(step_.scale[0]));
    replace(filter_pendulum_rate, shown_radps / Lanes(step_.scale[1]));
    replace(filter_cart_force, Lanes(0.0));
  }

  KalmanStep step_;
  Dynamics<Lanes> actuator_;
  State state_;
  LaneRing<Mask> drives_;  ///< voltages behind the static chain
};

template <class Mask>
class LaneObserver {
 public:
  /// No run has a longer delay than `longest_delay_s`.
  LaneObserver(const LoopSetup& setup, const LaneParts& parts, double longest_delay_s)
      : predictions_(parts.predictions),
        longest_periods_(longest_delay_s / setup.control.period_s()),
        gains_(setup.control.gains),
        cart_(make_estimator_step(setup.control.estimator, setup.control.period_s()),
              setup.cart_resolution_m),
        pendulum_(make_estimator_step(setup.control.estimator, setup.control.period_s()),
                  setup.angle_resolution_rad) {
    if (parts.estimator) filter_.emplace(*parts.estimator);
  }

  /// Says which delay the next run of this lane has.
  void take_delay(std::size_t lane, double delay_s) {
    if (predictions_ == nullptr) return;
    const FeedbackPrediction& prediction = predictions_->at(delay_s);
    if (!predictor_) predictor_.emplace(predictions_->plant(), prediction, longest_periods_);
    predictor_->take(lane, prediction);
  }

  /// At the start of the runs of these lanes, before their first period. Returns what the delay holds.
  Lanes start(const Mask& lanes, const Outputs<Lanes>& shown) {
    cart_.start(lanes, shown.cart_m);
    pendulum_.start(lanes, shown.theta_rad);
    if (filter_) filter_->start(lanes, cart_, pendulum_);
    const LaneMask starting = lanes & every();
    started_ = started_ & !starting;
    if (!predictor_) return start_feedback();
    const LanePredictor::State held =
        predictor_->shown(cart_.position, pendulum_.position, Lanes(0.0), Lanes(0.0));
    predictor_->start(starting, held);
    return predictor_->known_v(held);
  }
  /// After a period of these lanes. Returns what goes through the delay. `applied_v`: the voltage commanded
  /// over the period that just ended, after the amplifier's limit.
  Lanes take(const Mask& lanes, const Outputs<Lanes>& shown, const Lanes& applied_v) {
    started_ = started_ | (lanes & every());
    cart_.take(lanes, shown.cart_m);
    pendulum_.take(lanes, shown.theta_rad);
    if (filter_) filter_->take(lanes, cart_, pendulum_, applied_v);
    if (predictor_)
      return predictor_->known_v(filter_ ? filter_->estimate()
                                         : predictor_->shown(cart_.position, pendulum_.position,
                                                             cart_.velocity, pendulum_.velocity));
    return filter_ ? filter_->feedback(gains_) : sensed_feedback();
  }
  /// The command for what comes out of the delay.
  Lanes command_v(const Mask& lanes, const Lanes& delayed_v, const Lanes& applied_v) {
    Lanes feedback = delayed_v;
    if (predictor_) {
      const LaneMask begun = lanes & started_ & (applied_v == applied_v);
      if (any(begun)) feedback = predictor_->feedback_v(begun, delayed_v, applied_v);
      if (filter_) feedback = feedback + filter_->resting_v();
      if (!all(started_)) feedback = select(started_, feedback, start_feedback());
    }
    return filter_ ? filter_->command_v(feedback) : feedback;
  }

 private:
  Lanes start_feedback() const {
    return filter_ ? sensed_feedback() + filter_->resting_v() : sensed_feedback();
  }
  Lanes sensed_feedback() const {
    return Lanes(gains_.cart_position_v_per_m) * cart_.position +
           Lanes(gains_.pendulum_angle_v_per_rad) * pendulum_.position +
           Lanes(gains_.cart_velocity_v_per_mps) * cart_.velocity +
           Lanes(gains_.pendulum_rate_v_per_radps) * pendulum_.velocity;
  }

  static LaneMask every() { return Lanes(0.0) == Lanes(0.0); }

  LanePredictions* predictions_;
  double longest_periods_;
  Gains gains_;
  LaneSensor cart_, pendulum_;
  std::optional<LaneKalmanFilter<Mask>> filter_;
  std::optional<LanePredictor> predictor_;
  LaneMask started_ = !every();  ///< a period of the run has ended
};

}  // namespace upright
