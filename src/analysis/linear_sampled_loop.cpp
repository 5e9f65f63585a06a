#include "upright/analysis/linear_sampled_loop.hpp"

#include <cmath>

#include "upright/analysis/controllable_part.hpp"
#include "upright/analysis/dense_algebra.hpp"
#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A delay this near to a whole number of periods is that number, as in the delay line.
constexpr double whole_tolerance_periods = 1e-9;

struct Periods {
  int whole;
  double fraction;
};

Periods periods_of(double delay_s, double period_s) {
  const double periods = delay_s / period_s;
  const double whole = std::floor(periods + whole_tolerance_periods);
  const double fraction = periods - whole;
  return {static_cast<int>(whole), fraction > whole_tolerance_periods ? fraction : 0.0};
}

Eigen::RowVector4d gains_of(const ControlConfig& config) {
  const Gains& g = config.gains;
  return {g.cart_position_v_per_m, g.pendulum_angle_v_per_rad, g.cart_velocity_v_per_mps,
          g.pendulum_rate_v_per_radps};
}

}  // namespace

LinearSampledLoop::LinearSampledLoop(const Plant& plant, const ControlConfig& config, double smoothing)
    : period_s_(config.period_s()), gains_(gains_of(config)) {
  if (!plant.pendulum)
    throw ConfigError("give a plant with a pendulum: without one there is nothing to balance");
  const LinearPlant linear = linearize(plant, smoothing);
  const ControllablePart part = controllable_part(linear);
  const Periods input = periods_of(linear.input_delay_s, period_s_);
  input_periods_ = input.whole;
  const VectorXd per_volt = part.b * linear.actuator_slope;
  const SampledPlant late = hold_input(part.a, per_volt, (1.0 - input.fraction) * period_s_);
  const SampledPlant early = hold_input(part.a, per_volt, input.fraction * period_s_);
  const EstimatorStep f = make_estimator_step(config.estimator, period_s_);
  // States: plant n, the voltage before, (lag, velocity) of the cart's and of the pendulum's estimator.
  const Index n = part.a.rows(), last = n, filter = n + 1, all = n + 5;
  a_ = MatrixXd::Zero(all, all);
  b_ = VectorXd::Zero(all);
  a_.topLeftCorner(n, n) = late.a * early.a;
  a_.block(0, last, n, 1) = late.a * early.b;
  b_.head(n) = late.b;
  b_(last) = 1.0;
  shows_ = Eigen::Matrix4Xd::Zero(4, all);
  for (Index coordinate = 0; coordinate < 2; ++coordinate) {
    const Index lag = filter + 2 * coordinate, velocity = lag + 1;
    const double scale = linear.sensor_scale(coordinate);
    Eigen::RowVectorXd change = a_.row(coordinate) * scale;
    change(coordinate) -= scale;
    const double direct = b_(coordinate) * scale;
    a_.row(lag) = f.g1 * change;
    a_.row(velocity) = f.g2 * change;
    b_(lag) = f.g1 * direct;
    b_(velocity) = f.g2 * direct;
    a_(lag, lag) += f.p11;
    a_(lag, velocity) += f.p12;
    a_(velocity, lag) += f.p21;
    a_(velocity, velocity) += f.p22;
    shows_(coordinate, coordinate) = scale;
    shows_(coordinate + 2, velocity) = 1.0;
  }
  if (config.compensation.kind == CompensationKind::none) return;
  predictor_ = Predictor(config, read_plant_file(config.compensation.plant)).linear();
  compensated_delay_s_ = config.delay_s;
}

Complex LinearSampledLoop::line(Complex z, double delay_s) const {
  const Periods delay = periods_of(delay_s, period_s_);
  return std::pow(z, -delay.whole) * ((1.0 - delay.fraction) + delay.fraction / z);
}

Complex LinearSampledLoop::transfer(Complex z) const {
  Eigen::MatrixXcd m = -a_.cast<Complex>();
  m.diagonal().array() += z;
  const Eigen::VectorXcd states = solve(m, b_.cast<Complex>());
  const Eigen::Vector4cd shown = shows_.cast<Complex>() * states;
  const Complex input_delay = std::pow(z, -input_periods_);
  if (!predictor_) return (gains_.cast<Complex>() * shown)(0) * input_delay;
  const Eigen::RowVector4d measured = gains_ * predictor_->measured;
  return (measured.cast<Complex>() * shown)(0) * input_delay * line(z, compensated_delay_s_) /
         (1.0 - predicted_voltages(z));
}

/// What the predictor makes of the voltages it remembers, per volt now.
Complex LinearSampledLoop::predicted_voltages(Complex z) const {
  const Predictor::Linear& p = *predictor_;
  const Eigen::RowVectorXd direct = gains_ * p.voltages;
  const Complex shift = 1.0 / z;
  Complex sum = 0.0;
  for (Index i = 0; i < direct.size(); ++i) sum = (sum + direct(i)) * shift;
  const Complex acted =
      std::pow(z, static_cast<double>(-direct.size())) * ((1.0 - p.fraction) + p.fraction / z);
  const Complex next = acted / (1.0 + p.m1 / z + p.m0 / (z * z));
  const Complex now = next / z;
  return sum + gains_.dot(p.next) * next + gains_.dot(p.now) * now +
         gains_.dot(p.motor) * p.motor_gain * now / (z - p.motor_decay);
}

/// The shares of the newest value and those before it in a delayed one.
std::vector<double> LinearSampledLoop::taps(double delay_s) const {
  const auto shares = [this](double seconds) {
    const Periods delay = periods_of(seconds, period_s_);
    std::vector<double> list(static_cast<std::size_t>(delay.whole) + 2, 0.0);
    list[list.size() - 2] = 1.0 - delay.fraction;
    list[list.size() - 1] = delay.fraction;
    return list;
  };
  const std::vector<double> outer = shares(delay_s), inner = shares(compensated_delay_s_);
  std::vector<double> both(outer.size() + inner.size() - 1, 0.0);
  for (std::size_t i = 0; i < outer.size(); ++i)
    for (std::size_t j = 0; j < inner.size(); ++j) both[i + j] += outer[i] * inner[j];
  while (both.size() > 1 && both.back() == 0.0) both.pop_back();
  return both;
}

MatrixXd LinearSampledLoop::closed_loop(double delay_s) const {
  const std::vector<double> shares = taps(delay_s);
  const Index plant = a_.rows(), shown = static_cast<Index>(shares.size()) - 1;
  const Index buffered = predictor_ ? predictor_->voltages.cols() : 0;
  const Index volts = std::max<Index>(input_periods_, predictor_ ? buffered + 1 : 0);
  const Index first_shown = plant, first_volt = plant + shown, filter = first_volt + volts;
  const Index all = filter + (predictor_ ? 3 : 0);
  const Eigen::RowVector4d fed_back = predictor_ ? Eigen::RowVector4d(gains_ * predictor_->measured) : gains_;
  const Eigen::RowVectorXd output = fed_back * shows_;

  Eigen::RowVectorXd volt = Eigen::RowVectorXd::Zero(all);  // the voltage now, from all states
  volt.head(plant) = shares[0] * output;
  for (Index j = 1; j <= shown; ++j) volt(first_shown + j - 1) = shares[static_cast<std::size_t>(j)];
  MatrixXd matrix = MatrixXd::Zero(all, all);
  if (predictor_) {
    const Predictor::Linear& p = *predictor_;
    const Index now = filter, next = filter + 1, motor = filter + 2;
    matrix(now, next) = 1.0;
    matrix(next, next) = -p.m1;
    matrix(next, now) = -p.m0;
    matrix(next, first_volt + buffered - 1) = 1.0 - p.fraction;
    matrix(next, first_volt + buffered) = p.fraction;
    matrix(motor, motor) = p.motor_decay;
    matrix(motor, now) = p.motor_gain;
    const Eigen::RowVectorXd direct = gains_ * p.voltages;
    for (Index age = 1; age <= buffered; ++age) volt(first_volt + age - 1) += direct(buffered - age);
    volt += gains_.dot(p.now) * matrix.row(now) + gains_.dot(p.next) * matrix.row(next) +
            gains_.dot(p.motor) * matrix.row(motor);
  }
  matrix.topLeftCorner(plant, plant) = a_;
  if (input_periods_ == 0)
    matrix.topRows(plant) += b_ * volt;
  else
    matrix.block(0, first_volt + input_periods_ - 1, plant, 1) = b_;
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
