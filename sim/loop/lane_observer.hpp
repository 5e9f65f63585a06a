// What the controllers of sampled loops know of their plants, by lane: encoders with the velocity estimator,
// or with a stationary Kalman filter.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "lane_builds.hpp"
#include "lane_model.hpp"
#include "upright/control/velocity_estimator.hpp"
#include "upright/model/dynamics.hpp"
#include "upright/sim/loop/loop_run.hpp"

namespace upright {

/// Encoders and velocity estimate of one coordinate.
class LaneSensor {
 public:
  LaneSensor(const EstimatorStep& step, double resolution) : step_(step), resolution_(resolution) {}

  void start(const Lanes& value) { position = previous_ = stepped(value); }

  void take(const Lanes& value) {
    position = stepped(value);
    const Lanes dx = position - previous_;
    const Lanes next = Lanes(step_.p21) * lag_ + Lanes(step_.p22) * velocity + Lanes(step_.g2) * dx;
    lag_ = Lanes(step_.p11) * lag_ + Lanes(step_.p12) * velocity + Lanes(step_.g1) * dx;
    velocity = next;
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
class LaneKalmanFilter {
 public:
  explicit LaneKalmanFilter(const LaneEstimator& estimator)
      : step_(estimator.step),
        actuator_(on_lanes(estimator.model)),
        drives_(estimator.step.input_periods + 2) {}

  void start(const LaneSensor& cart, const LaneSensor& pendulum) {
    state_.fill(Lanes(0.0));
    const Lanes resting = actuator_.actuate(Lanes(0.0));
    for (Lanes& drive : drives_) drive = resting;
    newest_ = 0;
    if (step_.late[filter_motor] != 0.0) state_[filter_motor] = resting;
    state_[filter_cart] = step_.position_of(0, cart.position);
    state_[filter_theta] = step_.position_of(1, pendulum.position);
  }

  void take(const LaneSensor& cart, const LaneSensor& pendulum, const Lanes& applied_v) {
    newest_ = newest_ + 1 == drives_.size() ? 0 : newest_ + 1;
    drives_[newest_] = actuator_.actuate(applied_v);
    step_.propagate(state_, ago(step_.input_periods), ago(step_.input_periods + 1));
    const Lanes x = step_.position_of(0, cart.position), theta = step_.position_of(1, pendulum.position);
    step_.correct(state_, x - state_[filter_cart], theta - state_[filter_theta] - state_[filter_angle_zero]);
    const LaneMask far = absolute(theta) > Lanes(KalmanStep::linear_within_rad);
    if (any(far)) follow(far, x, theta, cart.velocity, pendulum.velocity);
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
  Lanes command_v(const Lanes& wanted_v) const { return step_.command_v(wanted_v); }
  /// The voltage that cancels the known force alone.
  Lanes resting_v() const { return step_.rejecting_v(Lanes(0.0)); }

 private:
  Lanes ago(std::size_t periods) const {
    return drives_[newest_ >= periods ? newest_ - periods : newest_ + drives_.size() - periods];
  }
  void follow(const LaneMask& lanes, const Lanes& x, const Lanes& theta, const Lanes& shown_mps,
              const Lanes& shown_radps) {
    const auto replace = [&](std::size_t state, const Lanes& value) {
      state_[state] = select(lanes, value, state_[state]);
    };
    replace(filter_cart, x);
    replace(filter_theta, theta);
    replace(filter_cart_velocity, shown_mps / Lanes(step_.scale[0]));
    replace(filter_pendulum_rate, shown_radps / Lanes(step_.scale[1]));
    replace(filter_cart_force, Lanes(0.0));
  }

  KalmanStep step_;
  Dynamics<Lanes> actuator_;
  std::array<Lanes, filter_states> state_;
  std::vector<Lanes> drives_;  ///< voltages behind the static chain, a ring; newest at `newest_`
  std::size_t newest_ = 0;
};

class LaneObserver {
 public:
  LaneObserver(const LoopSetup& setup, const LaneEstimator* estimator)
      : gains_(setup.control.gains),
        cart_(make_estimator_step(setup.control.estimator, setup.control.period_s()),
              setup.cart_resolution_m),
        pendulum_(make_estimator_step(setup.control.estimator, setup.control.period_s()),
                  setup.angle_resolution_rad) {
    if (estimator) filter_.emplace(*estimator);
  }

  /// The feedback at the start, before the first period.
  Lanes start(const Outputs<Lanes>& shown) {
    cart_.start(shown.cart_m);
    pendulum_.start(shown.theta_rad);
    if (filter_) filter_->start(cart_, pendulum_);
    return filter_ ? sensed_feedback() + filter_->resting_v() : sensed_feedback();
  }
  /// The feedback after a period. `applied_v`: the voltage commanded over the period that just ended, after
  /// the amplifier's limit.
  Lanes take(const Outputs<Lanes>& shown, const Lanes& applied_v) {
    cart_.take(shown.cart_m);
    pendulum_.take(shown.theta_rad);
    if (!filter_) return sensed_feedback();
    filter_->take(cart_, pendulum_, applied_v);
    return filter_->feedback(gains_);
  }
  /// The command for a feedback, delayed or not.
  Lanes command_v(const Lanes& feedback_v) const {
    return filter_ ? filter_->command_v(feedback_v) : feedback_v;
  }

 private:
  Lanes sensed_feedback() const {
    return Lanes(gains_.cart_position_v_per_m) * cart_.position +
           Lanes(gains_.pendulum_angle_v_per_rad) * pendulum_.position +
           Lanes(gains_.cart_velocity_v_per_mps) * cart_.velocity +
           Lanes(gains_.pendulum_rate_v_per_radps) * pendulum_.velocity;
  }

  Gains gains_;
  LaneSensor cart_, pendulum_;
  std::optional<LaneKalmanFilter> filter_;
};

}  // namespace upright
