#include "kalman_filter.hpp"

#include <algorithm>
#include <cmath>

#include "base/angle_units.hpp"
#include "upright/model/elementary.hpp"
#include "whole_periods.hpp"

namespace upright {

namespace {

KalmanStep::Column column_of(const FilterVector& vector) {
  KalmanStep::Column column;
  std::copy(vector.begin(), vector.end(), column.begin());
  return column;
}

}  // namespace

KalmanFilter::KalmanFilter(const ControlConfig& config, const Plant& plant)
    : model_(make_model<double>(plant)),
      actuator_(model_),
      cart_(make_estimator_step(config.estimator, config.period_s())),
      pendulum_(cart_) {
  const ContinuousModel model = continuous_model(plant);
  const double period_s = config.period_s();
  const WholePeriods input = whole_periods(model.input_delay_s, period_s);
  step_.input_periods = input.whole;
  input_fraction_ = input.fraction;
  const ModelStep whole = step_over(model, period_s);
  step_.late = column_of(whole.b);
  step_.constant = column_of(whole.constant);
  if (input_fraction_ > 0.0) {
    const ModelStep first = step_over(model, input_fraction_ * period_s),
                    rest = step_over(model, (1.0 - input_fraction_) * period_s);
    step_.early = column_of(rest.a * first.b);
    step_.late = column_of(rest.b);
  }
  const auto gain =
      kalman_gain(model, process_noise_of(config.state_estimator, plant), config.state_estimator, period_s);
  for (Eigen::Index i = 0; i < 2; ++i) {
    const auto at = static_cast<std::size_t>(i);
    step_.gain[at] = column_of(gain.col(i));
    step_.scale[at] = model.sensor_scale(i);
    step_.offset[at] = model.sensor_offset(i);
  }
  for (Eigen::Index i = 0; i < filter_states; ++i)
    step_.a[static_cast<std::size_t>(i)] = column_of(whole.a.col(i));
  slope_ = model.actuator_slope;
  step_.rejecting_v_per_n = -model.volts_per_newton / slope_;
  step_.share = config.rejection.share;
  step_.known_force_n = model.known_force_n + actuator_.actuate(0.0) / model.volts_per_newton;
  if (const PlantEffect* zone = plant.find("voltage_dead_zone")) step_.dead_zone_v = zone->values[0];
  const Resolution steps = resolution_of(config.state_estimator);
  step_.rounding_voltage_v = elementary::hypot(config.gains.cart_position_v_per_m * steps.cart_m,
                                               config.gains.pendulum_angle_v_per_rad * steps.angle_rad) /
                             std::sqrt(12.0);
  drives_.resize(step_.input_periods + 2);
  KalmanFilter::start(0.0, 0.0);
}

void KalmanFilter::start(double cart_m, double theta_rad) noexcept {
  for (double& drive : drives_) drive = resting_v();
  newest_ = 0;
  missed_ = 0;
  cart_.start(cart_m);
  pendulum_.start(theta_rad);
  state_.setZero();
  if (lags()) state_(filter_motor) = resting_v();
  const double theta = step_.position_of(1, theta_rad);
  turn_rad_ = full_turn_rad * std::round(theta / full_turn_rad);
  state_(filter_cart) = position_of(cart_m);
  state_(filter_theta) = theta - turn_rad_;
}

void KalmanFilter::advance(double applied_v) noexcept {
  newest_ = newest_ + 1 == drives_.size() ? 0 : newest_ + 1;
  drives_[newest_] = actuator_.actuate(applied_v);
  const auto ago = [this](std::size_t periods) {
    return drives_[newest_ >= periods ? newest_ - periods : newest_ + drives_.size() - periods];
  };
  propagate(ago(step_.input_periods), ago(step_.input_periods + 1));
}

void KalmanFilter::propagate(double late_v, double early_v) noexcept {
  step_.propagate(state_, late_v, early_v);
}

void KalmanFilter::update_velocities(double cart_m, double theta_rad) noexcept {
  const double from_m = cart_.position(), from_rad = pendulum_.position(), steps = missed_ + 1.0;
  for (std::uint32_t i = 1; i <= missed_; ++i) {
    cart_.step(from_m + i / steps * (cart_m - from_m));
    pendulum_.step(from_rad + i / steps * (theta_rad - from_rad));
  }
  missed_ = 0;
  cart_.step(cart_m);
  pendulum_.step(theta_rad);
}

ControlState KalmanFilter::update(double cart_m, double theta_rad, double applied_v) noexcept {
  advance(applied_v);
  update_velocities(cart_m, theta_rad);
  const double position = position_of(cart_m), theta = step_.position_of(1, theta_rad);
  const double turn = full_turn_rad * std::round(theta / full_turn_rad);
  state_(filter_theta) += turn_rad_ - turn;
  turn_rad_ = turn;
  const double lean = theta - turn;
  if (std::abs(lean) > KalmanStep::linear_within_rad) {
    state_(filter_cart) = position;
    state_(filter_theta) = lean;
    state_(filter_cart_velocity) = cart_.velocity() / step_.scale[0];
    state_(filter_pendulum_rate) = pendulum_.velocity() / step_.scale[1];
    state_(filter_cart_force) = 0.0;
    return shown();
  }
  const double cart_off = position - encoder_ahead_m() - state_(filter_cart);
  const double angle_off = lean - state_(filter_theta) - state_(filter_angle_zero);
  step_.correct(state_, cart_off, angle_off);
  return shown();
}

ControlState KalmanFilter::predict(double applied_v) noexcept {
  advance(applied_v);
  ++missed_;
  return shown();
}

ControlState KalmanFilter::shown() const noexcept {
  return {step_.scale[0] * state_(filter_cart),
          step_.scale[1] * (state_(filter_theta) + turn_rad_),
          step_.scale[0] * state_(filter_cart_velocity),
          step_.scale[1] * state_(filter_pendulum_rate),
          state_(filter_motor),
          rejected_force_n()};
}

double KalmanFilter::rejecting_v(const ControlState& estimate) const noexcept {
  return step_.rejecting_v(estimate.cart_force_n);
}

double KalmanFilter::command_v(double wanted_v) const noexcept {
  return step_.command_v(wanted_v);
}

KalmanFilter::Linear KalmanFilter::linear() const {
  const auto vector = [](const KalmanStep::Column& column) {
    return FilterVector(Eigen::Map<const FilterVector>(column.data()));
  };
  Eigen::Matrix<double, filter_states, 2> gain;
  gain << vector(step_.gain[0]), vector(step_.gain[1]);
  const Eigen::Vector2d scale(step_.scale[0], step_.scale[1]);
  Linear linear;
  for (Eigen::Index i = 0; i < filter_states; ++i)
    linear.a.col(i) = vector(step_.a[static_cast<std::size_t>(i)]);
  linear.keeps = FilterMatrix::Identity() - gain * shown_positions();
  linear.late = vector(step_.late) * slope_;
  linear.early = vector(step_.early) * slope_;
  linear.gain = gain * scale.cwiseInverse().asDiagonal();
  for (Eigen::Index i = 0; i < filter_states; ++i)
    if (i <= filter_pendulum_rate || gain.row(i).any() || linear.late(i) != 0.0) linear.present.push_back(i);
  linear.input_periods = step_.input_periods;
  linear.fed_back.setZero();
  for (Eigen::Index i = 0; i < 4; ++i) linear.fed_back(i, i) = scale(i % 2);
  linear.rejecting_v_per_n = step_.rejecting_v_per_n * step_.share;
  return linear;
}

}  // namespace upright
