#include "linear_sampled_loop.hpp"

#include <cmath>
#include <cstdio>

#include "control/estimate_predictor.hpp"
#include "control/kalman_filter.hpp"
#include "control/predictor.hpp"
#include "control/whole_periods.hpp"
#include "controllable_part.hpp"
#include "model/dense_algebra.hpp"
#include "upright/base/error.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Of what a ControlState holds: the four of the gain file, the motor's voltage, the force on the cart.
constexpr Index shown_count = 6;

Eigen::RowVectorXd gains_of(const ControlConfig& config) {
  const Gains& g = config.gains;
  Eigen::RowVectorXd gains = Eigen::RowVectorXd::Zero(shown_count);
  gains.head<4>() << g.cart_position_v_per_m, g.pendulum_angle_v_per_rad, g.cart_velocity_v_per_mps,
      g.pendulum_rate_v_per_radps;
  return gains;
}

}  // namespace

LinearSampledLoop::LinearSampledLoop(const Plant& plant, const ControlConfig& config, double smoothing,
                                     ExtraDelay extra)
    : period_s_(config.period_s()), extra_(extra), fed_back_(gains_of(config)) {
  if (!plant.pendulum)
    throw ConfigError("the plant has no pendulum to balance: name a plant file with a pendulum");
  const LinearPlant linear = linearize(plant, smoothing);
  const ControllablePart part = controllable_part(linear);
  const WholePeriods input = whole_periods(linear.input_delay_s, period_s_);
  const VectorXd per_volt = part.b * linear.actuator_slope;
  const SampledPlant late = hold_input(part.a, per_volt, (1.0 - input.fraction) * period_s_);
  const SampledPlant early = hold_input(part.a, per_volt, input.fraction * period_s_);
  // States: plant n, then the voltage before.
  const Index n = part.a.rows();
  a_ = MatrixXd::Zero(n + 1, n + 1);
  a_.topLeftCorner(n, n) = late.a * early.a;
  a_.block(0, n, n, 1) = late.a * early.b;
  VectorXd b = VectorXd::Zero(n + 1);
  b.head(n) = late.b;
  b(n) = 1.0;
  entries_.push_back({static_cast<int>(input.whole), b, true});
  if (config.has_state_estimator())
    add_state_estimator(config, read_plant_file(config.state_estimator.plant), linear.sensor_scale.head<2>());
  else
    add_velocity_estimator(config, linear.sensor_scale.head<2>());
  const bool predicts = config.compensation.kind != CompensationKind::none;
  if (predicts) add_prediction(config);
  base_delay_s_ = predicts || extra == ExtraDelay::unmodelled ? config.delay_s : 0.0;
  lined_delay_s_ = base_delay_s_;
  MatrixXd inputs(a_.rows(), static_cast<Index>(entries_.size()));
  for (std::size_t i = 0; i < entries_.size(); ++i) inputs.col(static_cast<Index>(i)) = entries_[i].per_volt;
  response_ = FrequencyResponse(a_, inputs, fed_back_ * shows_);
}

void LinearSampledLoop::resize(Index states) {
  const Index before = a_.rows();
  a_.conservativeResize(states, states);
  a_.rightCols(states - before).setZero();
  a_.bottomRows(states - before).setZero();
  entries_.front().per_volt.conservativeResize(states);
  entries_.front().per_volt.tail(states - before).setZero();
  shows_ = MatrixXd::Zero(shown_count, states);
}

/// (lag, velocity) of the cart's and of the pendulum's estimator.
void LinearSampledLoop::add_velocity_estimator(const ControlConfig& config, const Eigen::Vector2d& scales) {
  const EstimatorStep f = make_estimator_step(config.estimator, period_s_);
  const Index filter = a_.rows();
  resize(filter + 4);
  VectorXd& b = entries_.front().per_volt;
  for (Index coordinate = 0; coordinate < 2; ++coordinate) {
    const Index lag = filter + 2 * coordinate, velocity = lag + 1;
    const double scale = scales(coordinate);
    Eigen::RowVectorXd change = a_.row(coordinate) * scale;
    change(coordinate) -= scale;
    const double direct = b(coordinate) * scale;
    a_.row(lag) = f.g1 * change;
    a_.row(velocity) = f.g2 * change;
    b(lag) = f.g1 * direct;
    b(velocity) = f.g2 * direct;
    a_(lag, lag) += f.p11;
    a_(lag, velocity) += f.p12;
    a_(velocity, lag) += f.p21;
    a_(velocity, velocity) += f.p22;
    shows_(coordinate, coordinate) = scale;
    shows_(coordinate + 2, velocity) = 1.0;
  }
}

/// The filter's states; it takes the voltage twice, as the sensors show what it does and as the model says.
void LinearSampledLoop::add_state_estimator(const ControlConfig& config, const Plant& model,
                                            const Eigen::Vector2d& scale) {
  const KalmanFilter::Linear f = KalmanFilter(config, model).linear();
  const std::vector<Index>& at = f.present;
  const Index first = a_.rows(), count = static_cast<Index>(at.size());
  resize(first + count);
  VectorXd& b = entries_.front().per_volt;
  const MatrixXd gain = f.gain(at, Eigen::all) * scale.asDiagonal();
  const MatrixXd seen = gain * a_.topRows(2);
  a_.middleRows(first, count) += seen;
  b.segment(first, count) = gain * b.head(2);
  a_.block(first, first, count, count) += FilterMatrix(f.keeps * f.a)(at, at);
  for (const auto& [periods, per_volt] : {std::pair(f.input_periods, FilterVector(f.keeps * f.late)),
                                          std::pair(f.input_periods + 1, FilterVector(f.keeps * f.early))}) {
    VectorXd believed = VectorXd::Zero(first + count);
    believed.segment(first, count) = per_volt(at);
    if (believed.any()) entries_.push_back({static_cast<int>(periods), believed, false});
  }
  for (Index i = 0; i < count; ++i) {
    const Index state = at[static_cast<std::size_t>(i)];
    if (state < 4) shows_.block(0, first + i, 4, 1) = f.fed_back.col(state);
    if (state == filter_motor) shows_(4, first + i) = 1.0;
    if (state == filter_cart_force) shows_(5, first + i) = 1.0;
  }
  fed_back_(5) = f.rejecting_v_per_n;
}

void LinearSampledLoop::add_prediction(const ControlConfig& config) {
  const Plant plant = read_plant_file(config.compensation.plant);
  Prediction& p = prediction_;
  p.present = true;
  if (config.has_state_estimator()) {
    const EstimatePredictor::Linear linear = EstimatePredictor(config, plant).linear();
    p.voltages = fed_back_ * linear.voltages;
    const MatrixXd estimate = linear.estimate;
    fed_back_ = (fed_back_ * estimate).eval();
    return;
  }
  const Predictor::Linear linear = Predictor(config, plant).linear();
  const Eigen::RowVector4d gains = fed_back_.head<4>();
  p.voltages = gains * linear.voltages;
  p.now = gains.dot(linear.now);
  p.next = gains.dot(linear.next);
  p.motor = gains.dot(linear.motor);
  p.fraction = linear.fraction;
  p.m1 = linear.m1;
  p.m0 = linear.m0;
  p.motor_decay = linear.motor_decay;
  p.motor_gain = linear.motor_gain;
  fed_back_.head<4>() = gains * linear.measured;
}

Complex LinearSampledLoop::line(Complex z, double delay_s) const {
  const WholePeriods delay = whole_periods(delay_s, period_s_);
  return std::pow(z, -static_cast<int>(delay.whole)) * ((1.0 - delay.fraction) + delay.fraction / z);
}

Complex LinearSampledLoop::transfer(Complex z) const {
  const Complex lined = line(z, lined_delay_s_);
  const Eigen::RowVectorXcd per_entry = response_.at(z);
  Complex through_plant = 0.0, believed = 0.0;
  for (std::size_t i = 0; i < entries_.size(); ++i)
    (entries_[i].actuator ? through_plant : believed) +=
        per_entry(static_cast<Index>(i)) * lined * std::pow(z, -entries_[i].periods);
  const Complex rest = 1.0 - predicted_voltages(z);
  return extra_ == ExtraDelay::known ? (through_plant + believed) / rest : through_plant / (rest - believed);
}

/// What the predictor makes of the voltages it remembers, per volt now.
Complex LinearSampledLoop::predicted_voltages(Complex z) const {
  const Prediction& p = prediction_;
  if (!p.present) return 0.0;
  const Complex shift = 1.0 / z;
  Complex sum = 0.0;
  for (Index i = 0; i < p.voltages.size(); ++i) sum = (sum + p.voltages(i)) * shift;
  const Complex acted =
      std::pow(z, static_cast<double>(-p.voltages.size())) * ((1.0 - p.fraction) + p.fraction / z);
  const Complex next = acted / (1.0 + p.m1 / z + p.m0 / (z * z));
  const Complex now = next / z;
  return sum + p.next * next + p.now * now + p.motor * p.motor_gain * now / (z - p.motor_decay);
}

/// The shares of the newest value and those before it in a delayed one.
std::vector<double> LinearSampledLoop::shares(double delay_s) const {
  const WholePeriods delay = whole_periods(delay_s, period_s_);
  std::vector<double> list(delay.whole + 1, 0.0);
  list.back() = 1.0 - delay.fraction;
  if (delay.fraction > 0.0) list.push_back(delay.fraction);
  return list;
}

namespace {

std::vector<double> convolved(const std::vector<double>& outer, const std::vector<double>& inner) {
  std::vector<double> both(outer.size() + inner.size() - 1, 0.0);
  for (std::size_t i = 0; i < outer.size(); ++i)
    for (std::size_t j = 0; j < inner.size(); ++j) both[i + j] += outer[i] * inner[j];
  return both;
}

}  // namespace

void LinearSampledLoop::enter_voltages(MatrixXd& matrix, const Eigen::RowVectorXd& volt, Index first_volt,
                                       double actuator_delay_s) const {
  const Index states = a_.rows();
  const std::vector<double> late = shares(actuator_delay_s);
  for (const Entry& entry : entries_)
    for (std::size_t more = 0; more < (entry.actuator ? late.size() : 1); ++more) {
      const double share = entry.actuator ? late[more] : 1.0;
      const Index age = entry.periods + static_cast<Index>(more);
      if (age == 0)
        matrix.topRows(states) += share * entry.per_volt * volt;
      else
        matrix.block(0, first_volt + age - 1, states, 1) += share * entry.per_volt;
    }
}

double LinearSampledLoop::remembered_periods(double delay_s) const {
  double periods = (delay_s + lined_delay_s_) / period_s_ + static_cast<double>(prediction_.voltages.size());
  for (const Entry& entry : entries_) periods += entry.periods;
  return periods;
}

bool LinearSampledLoop::has_roots(double delay_s) const {
  return remembered_periods(delay_s) <= max_periods;
}

MatrixXd LinearSampledLoop::closed_loop(double delay_s) const {
  if (!has_roots(delay_s)) {
    char periods[32];
    std::snprintf(periods, sizeof periods, "%.0f", remembered_periods(delay_s));
    throw ConfigError(std::string("delay, prediction and input delay together last ") + periods +
                      " periods, which is too long to compute the roots of the loop: lower sample_rate_hz or "
                      "delay_s");
  }
  const bool known = extra_ == ExtraDelay::known;
  const std::vector<double> taps = convolved(shares(known ? delay_s : 0.0), shares(lined_delay_s_));
  const double actuator_delay_s = known ? 0.0 : delay_s;
  const Prediction& p = prediction_;
  const Index plant = a_.rows(), shown = static_cast<Index>(taps.size()) - 1, buffered = p.voltages.size();
  Index volts = p.present ? buffered + 1 : 0;
  for (const Entry& entry : entries_)
    volts = std::max(volts, entry.periods + static_cast<Index>(shares(actuator_delay_s).size()));
  const Index first_shown = plant, first_volt = plant + shown, filter = first_volt + volts;
  const Index all = filter + (p.present ? 3 : 0);
  const Eigen::RowVectorXd output = fed_back_ * shows_;

  Eigen::RowVectorXd volt = Eigen::RowVectorXd::Zero(all);  // the voltage now, from all states
  volt.head(plant) = taps[0] * output;
  for (Index j = 1; j <= shown; ++j) volt(first_shown + j - 1) = taps[static_cast<std::size_t>(j)];
  MatrixXd matrix = MatrixXd::Zero(all, all);
  if (p.present) {
    const Index now = filter, next = filter + 1, motor = filter + 2;
    matrix(now, next) = 1.0;
    matrix(next, next) = -p.m1;
    matrix(next, now) = -p.m0;
    matrix(next, first_volt + buffered - 1) = 1.0 - p.fraction;
    matrix(next, first_volt + buffered) = p.fraction;
    matrix(motor, motor) = p.motor_decay;
    matrix(motor, now) = p.motor_gain;
    for (Index age = 1; age <= buffered; ++age) volt(first_volt + age - 1) += p.voltages(buffered - age);
    volt += p.now * matrix.row(now) + p.next * matrix.row(next) + p.motor * matrix.row(motor);
  }
  matrix.topLeftCorner(plant, plant) = a_;
  enter_voltages(matrix, volt, first_volt, actuator_delay_s);
  if (shown > 0) matrix.block(first_shown, 0, 1, plant) = output;
  for (Index i = 1; i < shown; ++i) matrix(first_shown + i, first_shown + i - 1) = 1.0;
  if (volts > 0) matrix.row(first_volt) = volt;
  for (Index i = 1; i < volts; ++i) matrix(first_volt + i, first_volt + i - 1) = 1.0;
  return matrix;
}

Complex LinearSampledLoop::rightmost_root(double delay_s) const {
  const Eigen::VectorXcd roots = eigenvalues(closed_loop(delay_s));
  Index at = 0;
  roots.cwiseAbs().maxCoeff(&at);
  return std::log(Complex(roots(at).real(), std::abs(roots(at).imag()))) / period_s_;
}

}  // namespace upright
