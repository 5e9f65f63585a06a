#include "upright/control/controller.hpp"

#include <cmath>

#include "limiter.hpp"
#include "upright/base/error.hpp"

namespace upright {

Controller::Controller(const ControlConfig& config, double amplifier_limit_v, ModelParts parts)
    : config_(config),
      limit_v_(amplifier_limit_v),
      cart_(make_estimator_step(config.estimator, config.period_s())),
      pendulum_(cart_),
      delay_(config.delay_s, config.period_s()),
      parts_(std::move(parts)) {
  if (!(limit_v_ > 0.0) || !std::isfinite(limit_v_))
    throw ConfigError("the amplifier's voltage limit is " + exact_text(limit_v_) +
                      " V: set it to a value above 0");
  if (config.compensation.kind != CompensationKind::none && !parts_.compensator)
    throw ConfigError(
        "the gain file asks for a predictor, but this controller has none: use delay_compensation: {kind: "
        "none}");
  if (config.has_state_estimator() && !parts_.estimator)
    throw ConfigError(
        "the gain file asks for a state estimator, but this controller has none: use velocity_estimator");
}

void Controller::begin(const ControlInput& input) noexcept {
  cart_.start(input.cart_m);
  pendulum_.start(input.theta_rad);
  state_ = {input.cart_m, input.theta_rad, 0.0, 0.0};
  acting_ = state_;
  delay_.start(state_);
  voltage_v_ = 0.0;
  if (parts_.estimator) parts_.estimator->start(input.cart_m, input.theta_rad);
  if (parts_.compensator) parts_.compensator->start(state_);
  started_ = true;
}

void Controller::act_on(const ControlState& newest) noexcept {
  delay_.push(newest);
  acting_ = delay_.delayed();
  if (parts_.compensator) acting_ = parts_.compensator->compensate(acting_, voltage_v_);
}

/// As the device measured it, where the gain file asks for that and there is a value.
double Controller::velocity(VelocityEstimator& estimator, double position, double measured) const noexcept {
  const double estimated = estimator.step(position);
  return config_.estimator.kind == EstimatorKind::device && std::isfinite(measured) ? measured : estimated;
}

void Controller::advance(const ControlInput& input) noexcept {
  if (parts_.estimator)
    state_ = parts_.estimator->update(input.cart_m, input.theta_rad, voltage_v_);
  else
    state_ = {input.cart_m, input.theta_rad, velocity(cart_, input.cart_m, input.cart_velocity_mps),
              velocity(pendulum_, input.theta_rad, input.pendulum_rate_radps)};
  act_on(state_);
  state_.cart_m = input.cart_m;
  state_.theta_rad = input.theta_rad;
}

void Controller::advance_to(const ControlInput& input, std::uint64_t periods) noexcept {
  const ControlState before = state_;
  for (std::uint64_t i = 1; i < periods; ++i) {
    if (parts_.estimator) {
      act_on(parts_.estimator->predict(voltage_v_));
      continue;
    }
    const double part = static_cast<double>(i) / static_cast<double>(periods);
    const auto between = [part](double from, double to) { return from + part * (to - from); };
    ControlInput missing;
    missing.cart_m = between(before.cart_m, input.cart_m);
    missing.theta_rad = between(before.theta_rad, input.theta_rad);
    missing.cart_velocity_mps = between(before.cart_velocity_mps, input.cart_velocity_mps);
    missing.pendulum_rate_radps = between(before.pendulum_rate_radps, input.pendulum_rate_radps);
    advance(missing);
  }
  advance(input);
}

double Controller::feedback(const Demand& demand) const noexcept {
  const Gains& k = config_.gains;
  const double feedback_v = k.cart_position_v_per_m * (acting_.cart_m - demand.reference_m) +
                            k.pendulum_angle_v_per_rad * (acting_.theta_rad - demand.reference_rad) +
                            k.cart_velocity_v_per_mps * acting_.cart_velocity_mps +
                            k.pendulum_rate_v_per_radps * acting_.pendulum_rate_radps;
  if (!parts_.estimator) return feedback_v;
  return parts_.estimator->command_v(feedback_v + parts_.estimator->rejecting_v(acting_));
}

ControlOutput Controller::step(const ControlInput& input) noexcept {
  const std::uint64_t periods = input.tick - tick_;
  if (!started_ || periods == 0 || periods > max_missing_periods)
    begin(input);
  else
    advance_to(input, periods);
  tick_ = input.tick;
  ControlOutput output;
  output.state = state_;
  if (source_ != nullptr)
    output.demand = source_->next(input.tick, state_);
  else
    output.demand.reference_m = input.reference_m;
  output.lean_rad = state_.theta_rad - output.demand.reference_rad;
  output.voltage_requested_v = output.demand.feedback ? feedback(output.demand) : output.demand.voltage_v;
  const LimitedVoltage limited = limit_voltage(output.voltage_requested_v, limit_v_);
  output.voltage_v = limited.voltage_v;
  output.saturated = limited.saturated;
  output.finite = limited.finite;
  voltage_v_ = output.voltage_v;
  return output;
}

}  // namespace upright
