#include "estimate_predictor.hpp"

#include <algorithm>
#include <cmath>

#include "base/angle_units.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"
#include "whole_periods.hpp"

namespace upright {

EstimatePredictor::EstimatePredictor(const ControlConfig& config, const Plant& plant)
    : actuator_(make_model<double>(plant)) {
  ContinuousModel model = continuous_model(plant);
  if (config.rejection.decay_s > 0.0)
    model.a(filter_cart_force, filter_cart_force) = -1.0 / config.rejection.decay_s;
  slope_ = model.actuator_slope;
  scale_ << model.sensor_scale, model.sensor_scale, 1.0, 1.0;
  const double period_s = config.period_s();
  // How far it looks ahead: the loop's delay and the plant's input delay.
  const double horizon_s = config.delay_s + model.input_delay_s;
  const auto [whole, fraction] = whole_periods(horizon_s, period_s);
  free_steps_ = periods_within(config.delay_s, period_s);
  const ModelStep step = step_over(model, period_s), part = step_over(model, fraction * period_s),
                  lead = step_over(model, model.input_delay_s);
  step_ = predictor_step(step.a, step.b, step.constant);
  lead_ = predictor_step(lead.a, lead.b, lead.constant);
  const Matrix step_a = step.a.topLeftCorner<carried, carried>();
  const Vector step_b = step.b.head<carried>(), step_constant = step.constant.head<carried>();
  const auto count = static_cast<Eigen::Index>(whole) + 1;
  on_their_way_.resize(carried, count);
  for (Eigen::Index column = count - 1; column > 0; --column) {
    on_their_way_.col(column) = a_ * step_b;
    constant_ += a_ * step_constant;
    a_ = (a_ * step_a).eval();
  }
  on_their_way_.col(0) = a_ * part.b.head<carried>();
  constant_ += a_ * part.constant.head<carried>();
  a_ = (a_ * part.a.topLeftCorner<carried, carried>()).eval();
  if (!a_.allFinite() || !on_their_way_.allFinite())
    throw ConfigError("the prediction over " + exact_text(horizon_s) +
                      " s is not finite: use a shorter delay or a slower plant");
  window_ = static_cast<std::size_t>(count);
  drives_.resize(2 * window_);
  start({});
}

void EstimatePredictor::take(double drive_v) noexcept {
  drives_[first_] = drive_v;
  drives_[first_ + window_] = drive_v;
  first_ = first_ + 1 == window_ ? 0 : first_ + 1;
}

EstimatePredictor::Vector EstimatePredictor::true_state(const ControlState& shown) const noexcept {
  Vector state;
  state << shown.cart_m, shown.theta_rad, shown.cart_velocity_mps, shown.pendulum_rate_radps, shown.motor_v,
      shown.cart_force_n;
  return state.cwiseQuotient(scale_);
}

ControlState EstimatePredictor::shown(const Vector& state) const noexcept {
  return {state(0) * scale_(0),
          (state(1) + turn_rad_) * scale_(1),
          state(2) * scale_(2),
          state(3) * scale_(3),
          state(4),
          state(5)};
}

void EstimatePredictor::start(const ControlState& state) noexcept {
  const double resting_v = actuator_.actuate(0.0);
  for (double& drive : drives_) drive = resting_v;
  first_ = 0;
  steps_ = 0;
  Vector held = true_state(state);
  turn_rad_ = full_turn_rad * std::round(held(filter_theta) / full_turn_rad);
  held(filter_theta) -= turn_rad_;
  if (step_.b[filter_motor] != 0.0) held(filter_motor) = resting_v;
  std::copy(held.begin(), held.end(), free_state_.begin());
  lead_.propagate(free_state_, resting_v);
}

ControlState EstimatePredictor::compensate(const ControlState& delayed, double applied_v) noexcept {
  const double drive_v = actuator_.actuate(applied_v);
  take(drive_v);
  if (steps_ < free_steps_) {
    // The estimate is from before the start, when the body was held: go on from the start itself.
    ++steps_;
    step_.propagate(free_state_, drive_v);
    return shown(Vector::Map(free_state_.data()));
  }
  Vector state = true_state(delayed);
  turn_rad_ = full_turn_rad * std::round(state(filter_theta) / full_turn_rad);
  state(filter_theta) -= turn_rad_;
  Vector even = constant_ + a_ * state, odd = Vector::Zero();
  const double* drives = &drives_[first_];
  const Eigen::Index count = on_their_way_.cols();
  Eigen::Index i = 0;
  for (; i + 1 < count; i += 2) {
    even += on_their_way_.col(i) * drives[i];
    odd += on_their_way_.col(i + 1) * drives[i + 1];
  }
  if (i < count) even += on_their_way_.col(i) * drives[i];
  return shown(even + odd);
}

FeedbackPrediction EstimatePredictor::feedback(const Gains& gains, double volts_per_newton) const {
  Vector row = Vector::Zero();
  const FeedbackPrediction::Row volts = row_of(gains);
  row.head<4>() = Eigen::Vector4d::Map(volts.data()).cwiseProduct(scale_.head<4>());
  row(filter_cart_force) = volts_per_newton;
  FeedbackPrediction made;
  const Eigen::Matrix<double, 1, carried> known = row.transpose() * a_;
  std::copy(known.begin(), known.end(), made.known.begin());
  std::copy(row.begin(), row.end(), made.freely.begin());
  made.constant_v = row.dot(constant_);
  const Eigen::RowVectorXd on_their_way = row.transpose() * on_their_way_;
  made.on_their_way.assign(on_their_way.begin(), on_their_way.end());
  made.leaving = step_.of_a_volt(made.on_their_way.size() - 1);
  made.free_periods = free_steps_;
  made.step = step_;
  made.lead = lead_;
  made.lags = step_.b[filter_motor] != 0.0;
  made.scale = {scale_(0), scale_(1)};
  return made;
}

EstimatePredictor::Linear EstimatePredictor::linear() const {
  const Matrix shows = scale_.asDiagonal();
  return {shows * a_ * scale_.cwiseInverse().asDiagonal(), shows * on_their_way_ * slope_};
}

}  // namespace upright
