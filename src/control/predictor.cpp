#include "predictor.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "kalman_step.hpp"
#include "model/linear_plant.hpp"
#include "upright/base/error.hpp"
#include "whole_periods.hpp"

namespace upright {

namespace {

/// Position to velocity of an estimator: (n2 z^2 + n1 z + n0) / (z^2 + m1 z + m0).
struct FilterPolynomials {
  double n2, n1, n0, m1, m0;
};

FilterPolynomials polynomials_of(const EstimatorStep& f) {
  const double rest = f.p21 * f.g1 - f.p11 * f.g2;
  return {f.g2, rest - f.g2, -rest, -(f.p11 + f.p22), f.p11 * f.p22 - f.p12 * f.p21};
}

LinearPlant sliding_line(const Plant& plant) {
  if (!plant.pendulum)
    throw ConfigError(
        "the predictor's plant has no pendulum: name a plant file with a pendulum in delay_compensation");
  constexpr double any_smoothing = 1.0;  // no dry level is left to smooth
  return linearize(sliding_plant(without_vibrations(plant)), any_smoothing);
}

}  // namespace

Predictor::Line Predictor::sampled_line(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                                        const Eigen::VectorXd& f, double duration_s) {
  Eigen::MatrixXd inputs(model_states, 2);
  inputs << b, f;
  const SampledPlant sampled = hold_input(a, inputs, duration_s);
  return {sampled.a, sampled.b.col(0), sampled.b.col(1)};
}

Predictor::Predictor(const ControlConfig& config, const Plant& plant) : actuator_(make_model<double>(plant)) {
  const LinearPlant linear = sliding_line(plant);
  const Eigen::Index n = linear.a.rows();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(model_states, model_states);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(model_states), f = b;
  a.topLeftCorner(n, n) = linear.a;
  b.head(n) = linear.b;
  f.head(n) = linear.constant;
  slope_ = linear.actuator_slope;
  scale_ = linear.sensor_scale;
  offset_ = linear.sensor_offset;
  const double period_s = config.period_s();
  horizon_s_ = config.delay_s + linear.input_delay_s;
  const WholePeriods horizon = whole_periods(horizon_s_, period_s);
  whole_ = horizon.whole;
  fraction_ = horizon.fraction;
  free_steps_ = periods_within(config.delay_s, period_s);
  const Line line = sampled_line(a, b, f, period_s);
  step_ = predictor_step(line.a, line.b, line.f);
  const Line lead = sampled_line(a, b, f, linear.input_delay_s);
  lead_ = predictor_step(lead.a, lead.b, lead.f);
  filter_.motor_gain = line.b(model_states - 1);
  filter_.motor_decay = filter_.motor_gain == 0.0 ? 0.0 : line.a(model_states - 1, model_states - 1);
  const Recovery recovery = recover(line, make_estimator_step(config.estimator, period_s));
  combine(line, sampled_line(a, b, f, fraction_ * period_s), recovery);
  if (!weights_.measured.allFinite() || !weights_.on_their_way.allFinite())
    throw ConfigError("the prediction over " + exact_text(horizon_s_) + " s is not finite, " +
                      matrix_text("A", a) + ": use a shorter delay or a slower plant");
  window_ = whole_ + 2;
  drives_.resize(2 * window_);
  start({});
}

Predictor::Recovery Predictor::recover(const Line& line, const EstimatorStep& filter) {
  const FilterPolynomials p = polynomials_of(filter);
  filter_.m1 = p.m1;
  filter_.m0 = p.m0;
  const Matrix identity = Matrix::Identity(), square = line.a * line.a;
  const Matrix m = square + p.m1 * line.a + p.m0 * identity;
  const Matrix n = p.n2 * square + p.n1 * line.a + p.n0 * identity;
  // What an input held for ever after 1 / M(z) adds: its filtered value is 1 / M(1).
  const double settled = 1.0 / (1.0 + p.m1 + p.m0);
  Eigen::Matrix<double, model_states, 3> onto_state, onto_filtered;
  onto_state << line.a * line.b + p.m1 * line.b, line.b, settled * (line.a * line.f + (p.m1 + 1.0) * line.f);
  onto_filtered << p.n2 * line.a * line.b + p.n1 * line.b, p.n2 * line.b,
      settled * (p.n2 * line.a * line.f + (p.n1 + p.n2) * line.f);
  Eigen::Matrix<double, 4, model_states> shows;
  shows << m.topRows<2>(), n.topRows<2>();
  Eigen::Matrix<double, 4, 3> adds;
  adds << onto_state.topRows<2>(), onto_filtered.topRows<2>();
  const Eigen::Matrix4d inverse = shows.leftCols<4>().inverse();
  Recovery recovery;
  recovery.measured = m.leftCols<4>() * inverse;
  const Eigen::Matrix<double, model_states, 3> rest = onto_state - recovery.measured * adds;
  recovery.now = rest.col(0);
  recovery.next = rest.col(1);
  recovery.constant = rest.col(2);
  recovery.motor = m.col(4) - recovery.measured * shows.col(4);
  return recovery;
}

void Predictor::combine(const Line& line, const Line& part, const Recovery& recovery) {
  const auto count = static_cast<Eigen::Index>(whole_) + 1;
  weights_.on_their_way.resize(4, count);
  Matrix ahead = Matrix::Identity();
  Vector constant = Vector::Zero();
  for (Eigen::Index column = count - 1; column > 0; --column) {
    weights_.on_their_way.col(column) = (ahead * line.b).head<4>();
    constant += ahead * line.f;
    ahead = (ahead * line.a).eval();
  }
  weights_.on_their_way.col(0) = (ahead * part.b).head<4>();
  constant += ahead * part.f;
  ahead = (ahead * part.a).eval();
  weights_.measured = (ahead * recovery.measured).topRows<4>();
  weights_.filtered_now = (ahead * recovery.now).head<4>();
  weights_.filtered_next = (ahead * recovery.next).head<4>();
  weights_.filtered_motor = (ahead * recovery.motor).head<4>();
  weights_.constant = (ahead * recovery.constant + constant).head<4>();
}

Predictor::Linear Predictor::linear() const {
  const Eigen::Matrix4d shows = scale_.asDiagonal();
  const Eigen::Matrix4d per_volt = shows * slope_;
  return {shows * weights_.measured * scale_.cwiseInverse().asDiagonal(),
          per_volt * weights_.on_their_way,
          per_volt * weights_.filtered_now,
          per_volt * weights_.filtered_next,
          per_volt * weights_.filtered_motor,
          fraction_,
          filter_.m1,
          filter_.m0,
          filter_.motor_decay,
          filter_.motor_gain};
}

FeedbackPrediction Predictor::feedback(const Gains& gains) const {
  const FeedbackPrediction::Row of_gains = row_of(gains);
  const Eigen::Vector4d volts = Eigen::Vector4d::Map(of_gains.data());
  const Eigen::RowVector4d row = volts.cwiseProduct(scale_).transpose();
  FeedbackPrediction made;
  const Eigen::RowVector4d known = row * weights_.measured;
  std::copy(known.begin(), known.end(), made.known.begin());
  std::copy(row.begin(), row.end(), made.freely.begin());
  made.freely_constant_v = volts.dot(offset_);
  made.constant_v = made.freely_constant_v + row * weights_.constant;
  made.now = row * weights_.filtered_now;
  made.next = row * weights_.filtered_next;
  made.motor = row * weights_.filtered_motor;
  const Eigen::RowVectorXd on_their_way = row * weights_.on_their_way;
  made.on_their_way.assign(on_their_way.begin(), on_their_way.end());
  made.leaving = step_.of_a_volt(made.on_their_way.size() - 1);
  made.fraction = fraction_;
  made.free_periods = free_steps_;
  made.step = step_;
  made.lead = lead_;
  made.filter = filter_;
  made.lags = filter_.motor_gain != 0.0;
  made.scale = {scale_(0), scale_(1)};
  made.offset = {offset_(0), offset_(1)};
  return made;
}

void Predictor::take(double drive_v) noexcept {
  drives_[first_] = drive_v;
  drives_[first_ + window_] = drive_v;
  first_ = first_ + 1 == window_ ? 0 : first_ + 1;
}

void Predictor::start(const ControlState& state) noexcept {
  const double resting_v = actuator_.actuate(0.0);
  for (double& drive : drives_) drive = resting_v;
  first_ = 0;
  filtered_ = filter_.started(resting_v);
  steps_ = 0;
  const Eigen::Vector4d measured(state.cart_m, state.theta_rad, state.cart_velocity_mps,
                                 state.pendulum_rate_radps);
  const Eigen::Vector4d held = (measured - offset_).cwiseQuotient(scale_);
  std::copy(held.begin(), held.end(), free_state_.begin());
  free_state_[filter_motor] = filter_.motor_gain == 0.0 ? 0.0 : resting_v;
  lead_.propagate(free_state_, resting_v);
}

ControlState Predictor::shown(const Eigen::Vector4d& state) const noexcept {
  return {state(0) * scale_(0) + offset_(0), state(1) * scale_(1) + offset_(1),
          state(2) * scale_(2) + offset_(2), state(3) * scale_(3) + offset_(3)};
}

ControlState Predictor::compensate(const ControlState& delayed, double applied_v) noexcept {
  const double drive_v = actuator_.actuate(applied_v);
  take(drive_v);
  // The window, oldest first: one that acted before the measurement, one that acted around it, then the rest.
  const double* drives = &drives_[first_];
  filter_.take(filtered_, (1.0 - fraction_) * drives[1] + fraction_ * drives[0]);
  if (steps_ < free_steps_) {
    // What is measured is from before the start, when the body was held: go on from the start itself.
    ++steps_;
    step_.propagate(free_state_, drive_v);
    return shown(Eigen::Vector4d::Map(free_state_.data()));
  }
  const Eigen::Vector4d measured(delayed.cart_m, delayed.theta_rad, delayed.cart_velocity_mps,
                                 delayed.pendulum_rate_radps);
  Eigen::Vector4d even = weights_.constant + weights_.measured * (measured - offset_).cwiseQuotient(scale_);
  even += weights_.filtered_now * filtered_.now + weights_.filtered_next * filtered_.next +
          weights_.filtered_motor * filtered_.motor;
  Eigen::Vector4d odd = Eigen::Vector4d::Zero();
  const double* on_their_way = drives + 1;
  const Eigen::Index count = weights_.on_their_way.cols();
  Eigen::Index i = 0;
  for (; i + 1 < count; i += 2) {
    even += weights_.on_their_way.col(i) * on_their_way[i];
    odd += weights_.on_their_way.col(i + 1) * on_their_way[i + 1];
  }
  if (i < count) even += weights_.on_their_way.col(i) * on_their_way[i];
  return shown(even + odd);
}

}  // namespace upright
