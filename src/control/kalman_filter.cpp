#include "kalman_filter.hpp"

#include <algorithm>
#include <cmath>

#include "base/angle_units.hpp"
#include "upright/model/elementary.hpp"
#include "whole_periods.hpp"

namespace upright {

KalmanFilter::KalmanFilter(const ControlConfig& config, const Plant& plant)
    : actuator_(make_model<double>(plant)),
      cart_(make_estimator_step(config.estimator, config.period_s())),
      pendulum_(cart_) {
  const ContinuousModel model = continuous_model(plant);
  const double period_s = config.period_s();
  const WholePeriods input = whole_periods(model.input_delay_s, period_s);
  input_periods_ = input.whole;
  input_fraction_ = input.fraction;
  step_ = step_over(model, period_s);
  if (input_fraction_ > 0.0) {
    const ModelStep first = step_over(model, input_fraction_ * period_s),
                    rest = step_over(model, (1.0 - input_fraction_) * period_s);
    early_ = rest.a * first.b;
    step_.b = rest.b;
  }
  gain_ =
      kalman_gain(model, process_noise_of(config.state_estimator, plant), config.state_estimator, period_s);
  scale_ = model.sensor_scale;
  offset_ = model.sensor_offset;
  slope_ = model.actuator_slope;
  rejecting_v_per_n_ = -model.volts_per_newton / slope_;
  share_ = config.rejection.share;
  known_force_n_ = model.known_force_n + actuator_.actuate(0.0) / model.volts_per_newton;
  if (const PlantEffect* zone = plant.find("voltage_dead_zone")) dead_zone_v_ = zone->values[0];
  const Resolution steps = resolution_of(config.state_estimator);
  rounding_voltage_v_ = elementary::hypot(config.gains.cart_position_v_per_m * steps.cart_m,
                                          config.gains.pendulum_angle_v_per_rad * steps.angle_rad) /
                        std::sqrt(12.0);
  drives_.resize(input_periods_ + 2);
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
  const double theta = (theta_rad - offset_(1)) / scale_(1);
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
  propagate(ago(input_periods_), ago(input_periods_ + 1));
}

void KalmanFilter::propagate(double late_v, double early_v) noexcept {
  state_ = (step_.a * state_ + step_.b * late_v + early_ * early_v + step_.constant).eval();
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
  const double position = position_of(cart_m), theta = (theta_rad - offset_(1)) / scale_(1);
  const double turn = full_turn_rad * std::round(theta / full_turn_rad);
  state_(filter_theta) += turn_rad_ - turn;
  turn_rad_ = turn;
  const double lean = theta - turn;
  if (std::abs(lean) > linear_within_rad) {
    state_(filter_cart) = position;
    state_(filter_theta) = lean;
    state_(filter_cart_velocity) = cart_.velocity() / scale_(0);
    state_(filter_pendulum_rate) = pendulum_.velocity() / scale_(1);
    state_(filter_cart_force) = 0.0;
    return shown();
  }
  const double cart_off = position - drive_deflection_m() - state_(filter_cart);
  const double angle_off = lean - state_(filter_theta) - state_(filter_angle_zero);
  state_ += gain_.col(0) * cart_off + gain_.col(1) * angle_off;
  return shown();
}

ControlState KalmanFilter::predict(double applied_v) noexcept {
  advance(applied_v);
  ++missed_;
  return shown();
}

ControlState KalmanFilter::shown() const noexcept {
  return {scale_(0) * state_(filter_cart),
          scale_(1) * (state_(filter_theta) + turn_rad_),
          scale_(0) * state_(filter_cart_velocity),
          scale_(1) * state_(filter_pendulum_rate),
          state_(filter_motor),
          rejected_force_n()};
}

double KalmanFilter::rejecting_v(const ControlState& estimate) const noexcept {
  return rejecting_v_per_n_ * (estimate.cart_force_n + share_ * known_force_n_);
}

double KalmanFilter::command_v(double wanted_v) const noexcept {
  if (!(dead_zone_v_ > 0.0)) return wanted_v;
  return wanted_v + dead_zone_v_ * std::clamp(wanted_v / rounding_voltage_v_, -1.0, 1.0);
}

KalmanFilter::Linear KalmanFilter::linear() const {
  Linear linear;
  linear.a = step_.a;
  linear.keeps = FilterMatrix::Identity() - gain_ * shown_positions();
  linear.late = step_.b * slope_;
  linear.early = early_ * slope_;
  linear.gain = gain_ * scale_.cwiseInverse().asDiagonal();
  for (Eigen::Index i = 0; i < filter_states; ++i)
    if (i <= filter_pendulum_rate || gain_.row(i).any() || step_.b(i) != 0.0) linear.present.push_back(i);
  linear.input_periods = input_periods_;
  linear.fed_back.setZero();
  for (Eigen::Index i = 0; i < 4; ++i) linear.fed_back(i, i) = scale_(i % 2);
  linear.rejecting_v_per_n = rejecting_v_per_n_ * share_;
  return linear;
}

}  // namespace upright
