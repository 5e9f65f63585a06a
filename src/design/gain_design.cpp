#include "gain_design.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "model/dense_algebra.hpp"
#include "model/riccati.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

/// The longest delay line taken into the Riccati equation as states; beyond it the equation without is used
/// alone.
constexpr int longest_delay_line = 400;

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

/// Says what `without_vibrations` means for a design. `rest`: how the poles or the predictor take it.
void note_vibrations(std::vector<std::string>& notes, const Plant& plant, const std::string& rest) {
  if (plant.find("sprung_mass") != nullptr)
    notes.push_back("sprung_mass: it is not measured, and the gains take it as fixed to the cart" + rest);
  if (plant.find("flexible_rod") != nullptr)
    notes.push_back("flexible_rod: its vibration is not measured, and the gains take the rod as rigid" +
                    rest);
}

/// The plant with its motor lag taken as quick: the motor voltage is its command. `lagging` tells whether it
/// was there.
LinearPlant without_motor_lag(const LinearPlant& linear, bool& lagging) {
  lagging = linear.states.back() == "motor_v";
  if (!lagging) return linear;
  LinearPlant quick = linear;
  const Index n = linear.a.rows() - 1;
  quick.states.pop_back();
  quick.b = linear.a.col(n).head(n);
  quick.a = linear.a.topLeftCorner(n, n).eval();
  quick.constant = linear.constant.head(n).eval();
  return quick;
}

MatrixXd weight_matrix(const LinearPlant& linear, const DesignWeights& weights) {
  const auto count = static_cast<Index>(linear.fed_back.size());
  MatrixXd q = MatrixXd::Zero(count, count);
  for (Index i = 0; i < count; ++i) q(i, i) = weights.q[linear.fed_back[static_cast<std::size_t>(i)]];
  return q;
}

/// Gains on what the sensors show, from the optimal feedback u = -k x of the true states.
std::array<double, 4> measured_gains(const LinearPlant& linear, const RowVectorXd& k) {
  std::array<double, 4> gains{};
  for (std::size_t i = 0; i < linear.fed_back.size(); ++i) {
    const auto at = static_cast<Index>(i);
    gains[linear.fed_back[i]] = -k(at) / linear.sensor_scale(at);
  }
  return gains;
}

std::vector<std::complex<double>> sorted_eigenvalues(const MatrixXd& matrix) {
  const Eigen::VectorXcd values = eigenvalues(matrix);
  std::vector<std::complex<double>> list(values.begin(), values.end());
  std::sort(list.begin(), list.end(), [](const auto& a, const auto& b) {
    return a.real() != b.real() ? a.real() > b.real() : a.imag() > b.imag();
  });
  return list;
}

/// The paper's (10) prints the gain of an eliminated state's partner as the share that orthogonal coordinates
/// leave it.
void add_shares(GainDesign& design, const ControllablePart& part, const RowVectorXd& k) {
  const RowVectorXd shares = k * inverse(part.follow.transpose() * part.follow) * part.follow.transpose();
  for (std::size_t i = 0; i < design.eliminated.size(); ++i) {
    EliminatedState& state = design.eliminated[i];
    for (Index j = 0; j < k.size(); ++j) {
      const double whole = -k(j), share = -shares(j);
      const double own = -shares(k.size() + static_cast<Index>(i));
      if (std::abs(whole - share) <= 1e-9 * std::abs(whole)) continue;
      const std::string& name = part.states[static_cast<std::size_t>(j)];
      state.explanation +=
          "; in coordinates that treat " + name + " and " + state.state + " alike the gain " +
          number_text(whole) + " on " + name + " reads " + number_text(share) + " on " + name + " and " +
          number_text(own) + " on " + state.state +
          ", as the paper's (10) prints it for its dynamic friction (85.0828, half of 170.17); " +
          state.state + " is not measured, so " + name + " must carry the whole";
    }
  }
}

void record_plant_structure(GainDesign& design, const Plant& plant, const LinearPlant& linear) {
  design.notes = linear.notes;
  if (linear.input_delay_s > 0.0)
    design.notes.push_back("input_delay: its " + exact_text(linear.input_delay_s) +
                           " s do not enter a continuous design; see --delay");
  if (plant.find("voltage_saturation") != nullptr)
    design.notes.emplace_back("voltage_saturation: the design holds below the limit");
  note_vibrations(design.notes, plant, "; the closed-loop poles are those with it");
}

/// Poles of the whole controllable plant, with its motor lag and vibrations, under the gains.
void find_poles(GainDesign& design, const LinearPlant& linear, const RowVectorXd& k) {
  const ControllablePart whole = controllable_part(linear);
  RowVectorXd feedback = RowVectorXd::Zero(whole.a.rows());
  feedback.head(k.size()) = k;
  design.closed_loop_poles = sorted_eigenvalues(whole.a - whole.b * (linear.actuator_slope * feedback));
  if (design.closed_loop_poles.front().real() >= 0.0)
    throw ConfigError(
        "the gains designed with a quick motor, a fixed sprung mass and a rigid rod do not stabilize the "
        "plant with its motor_lag, sprung_mass and flexible_rod, " +
        matrix_text("A", whole.a) + ", " + matrix_text("b", whole.b) +
        ": raise --r, or shorten the motor lag");
}

void refuse_unreadable(const LinearPlant& linear) {
  if (linear.actuator_slope != 0.0 && std::isfinite(linear.actuator_slope)) return;
  throw ConfigError("the amplifier is saturated at zero volts, " +
                    matrix_text("b", linear.b * linear.actuator_slope) +
                    ": lower voltage_offset below the limit of voltage_saturation");
}

}  // namespace

GainDesign design_gains(const Plant& plant, const DesignWeights& weights, double smoothing) {
  const LinearPlant linear = linearize(plant, smoothing);
  refuse_unreadable(linear);
  bool lagging = false;
  const LinearPlant quick = without_motor_lag(linearize(without_vibrations(plant), smoothing), lagging);
  const ControllablePart part = controllable_part(quick);
  const RiccatiSolution solution = solve_continuous_riccati(part.a, part.b * quick.actuator_slope,
                                                            weight_matrix(quick, weights), weights.r);
  GainDesign design;
  design.gains = measured_gains(quick, solution.gain);
  design.residual = solution.residual;
  design.eliminated = part.eliminated;
  add_shares(design, part, solution.gain);
  record_plant_structure(design, plant, linear);
  if (lagging)
    design.eliminated.push_back({"motor_v", linear.a(linear.a.rows() - 1, linear.a.rows() - 1),
                                 "motor_v is not measured: the gains take the motor lag as quick (motor_v "
                                 "equal to its command); the closed-loop "
                                 "poles are those with the lag"});
  find_poles(design, linear, solution.gain);
  return design;
}

namespace {

/// The plant over one period and the cost along it, with the held voltage as one more column (Van Loan 1978).
struct SampledProblem {
  MatrixXd a;
  VectorXd b;
  MatrixXd q;
  VectorXd s;
  double r;
};

SampledProblem sample_problem(const MatrixXd& a, const VectorXd& b, const MatrixXd& q, double r,
                              double period_s) {
  const Index n = a.rows();
  MatrixXd held = MatrixXd::Zero(n + 1, n + 1), cost = MatrixXd::Zero(n + 1, n + 1);
  held.topLeftCorner(n, n) = a;
  held.topRightCorner(n, 1) = b;
  cost.topLeftCorner(n, n) = q;
  cost(n, n) = r;
  // d/dt [P; G] = [-held' cost; 0 held] gives G = e^(held T) and G' P = the integral of e^(held' t) cost
  // e^(held t).
  MatrixXd block = MatrixXd::Zero(2 * n + 2, 2 * n + 2);
  block.topLeftCorner(n + 1, n + 1) = -held.transpose();
  block.topRightCorner(n + 1, n + 1) = cost;
  block.bottomRightCorner(n + 1, n + 1) = held;
  const MatrixXd step = hold_input(block, MatrixXd::Zero(2 * n + 2, 0), period_s).a;
  const MatrixXd g = step.bottomRightCorner(n + 1, n + 1);
  const MatrixXd integral = g.transpose() * step.topRightCorner(n + 1, n + 1) / period_s;
  return {g.topLeftCorner(n, n), g.topRightCorner(n, 1),
          0.5 * (integral + integral.transpose()).topLeftCorner(n, n), integral.topRightCorner(n, 1),
          integral(n, n)};
}

/// The problem with `periods` voltages on their way as states, oldest first. A voltage's own cost may be
/// counted at any place of the line: half is counted where it acts, which keeps the cost of the line's states
/// from being negative, and half where it is commanded.
SampledProblem with_delay_line(const SampledProblem& direct, int periods) {
  const Index n = direct.a.rows(), d = periods;
  SampledProblem line{MatrixXd::Zero(n + d, n + d), VectorXd::Zero(n + d), MatrixXd::Zero(n + d, n + d),
                      VectorXd::Zero(n + d), 0.5 * direct.r};
  line.a.topLeftCorner(n, n) = direct.a;
  line.a.block(0, n, n, 1) = direct.b;
  for (Index i = 0; i + 1 < d; ++i) line.a(n + i, n + i + 1) = 1.0;
  line.b(n + d - 1) = 1.0;
  line.q.topLeftCorner(n, n) = direct.q;
  line.q.block(0, n, n, 1) = direct.s;
  line.q.block(n, 0, 1, n) = direct.s.transpose();
  line.q(n, n) = 0.5 * direct.r;
  return line;
}

/// The problem with the velocity estimator's states behind it: (lag, velocity) of each coordinate. They cost
/// nothing and move nothing.
SampledProblem with_estimator(const SampledProblem& line, Index coordinates, const EstimatorStep& f) {
  const Index n = line.a.rows(), all = n + 2 * coordinates;
  SampledProblem whole{MatrixXd::Zero(all, all), VectorXd::Zero(all), MatrixXd::Zero(all, all),
                       VectorXd::Zero(all), line.r};
  whole.a.topLeftCorner(n, n) = line.a;
  whole.b.head(n) = line.b;
  whole.q.topLeftCorner(n, n) = line.q;
  whole.s.head(n) = line.s;
  for (Index i = 0; i < coordinates; ++i) {
    const Index lag = n + 2 * i, velocity = lag + 1;
    RowVectorXd change = line.a.row(i);
    change(i) -= 1.0;
    whole.a.row(lag).head(n) = f.g1 * change;
    whole.a.row(velocity).head(n) = f.g2 * change;
    whole.b(lag) = f.g1 * line.b(i);
    whole.b(velocity) = f.g2 * line.b(i);
    whole.a.block(lag, lag, 2, 2) << f.p11, f.p12, f.p21, f.p22;
  }
  return whole;
}

/// log(z) / T of the eigenvalues z of a sampled loop.
std::vector<std::complex<double>> poles_of(const MatrixXd& closed, double rate_hz) {
  std::vector<std::complex<double>> poles = sorted_eigenvalues(closed);
  for (std::complex<double>& pole : poles) pole = std::log(pole) * rate_hz;
  return poles;
}

/// The gain that feeding back `k` on the predicted state is on (state, voltages on their way, estimator).
RowVectorXd gain_through_prediction(const RowVectorXd& k, const SampledProblem& direct, int periods,
                                    Index estimator_states) {
  const Index n = direct.a.rows();
  RowVectorXd whole = RowVectorXd::Zero(n + periods + estimator_states);
  RowVectorXd ahead = k;
  for (Index i = periods - 1; i >= 0; --i) {
    whole(n + i) = ahead.dot(direct.b);
    ahead = ahead * direct.a;
  }
  whole.head(n) = ahead;
  return whole;
}

void check_with_all_states(SampledDesign& result, const SampledProblem& direct, const RowVectorXd& k,
                           Index coordinates, const EstimatorStep& estimator) {
  if (result.delay_periods > longest_delay_line) return;
  const SampledProblem line =
      result.delay_periods > 0 ? with_delay_line(direct, result.delay_periods) : direct;
  const SampledProblem whole = with_estimator(line, coordinates, estimator);
  const DiscreteRiccatiSolution solution =
      solve_discrete_riccati(whole.a, whole.b, whole.q, whole.s, MatrixXd::Constant(1, 1, whole.r));
  const RowVectorXd expected = gain_through_prediction(k, direct, result.delay_periods, 2 * coordinates);
  result.delay_line_residual = solution.residual;
  result.delay_line_difference = (solution.gain - expected).norm() / expected.norm();
}

}  // namespace

SampledDesign design_sampled_gains(const Plant& plant, const DesignWeights& weights, double smoothing,
                                   double rate_hz, double delay_s, const EstimatorConfig& estimator) {
  const LinearPlant linear = linearize(without_vibrations(plant), smoothing);
  refuse_unreadable(linear);
  bool lagging = false;
  const LinearPlant quick = without_motor_lag(linear, lagging);
  const ControllablePart part = controllable_part(quick);
  const double period_s = 1.0 / rate_hz;
  const SampledProblem direct = sample_problem(part.a, part.b * quick.actuator_slope,
                                               weight_matrix(quick, weights), weights.r, period_s);
  const DiscreteRiccatiSolution solution =
      solve_discrete_riccati(direct.a, direct.b, direct.q, direct.s, MatrixXd::Constant(1, 1, direct.r));
  SampledDesign result;
  result.prediction_s = delay_s + linear.input_delay_s;
  result.delay_periods = static_cast<int>(std::ceil(result.prediction_s * rate_hz - 1e-9));
  result.design.gains = measured_gains(quick, solution.gain);
  result.design.residual = solution.residual;
  result.design.eliminated = part.eliminated;
  result.design.notes = linear.notes;
  result.design.closed_loop_poles = poles_of(direct.a - direct.b * solution.gain, rate_hz);
  add_shares(result.design, part, solution.gain);
  if (lagging)
    result.design.notes.emplace_back("motor_lag: the gains take it as quick; the predictor follows it");
  note_vibrations(result.design.notes, plant, ", as the predictor does");
  check_with_all_states(result, direct, solution.gain, static_cast<Index>(linear.fed_back.size()) / 2,
                        make_estimator_step(estimator, period_s));
  return result;
}

GainCost::GainCost(const Plant& plant, const DesignWeights& weights, double smoothing, double rate_hz)
    : rate_hz_(rate_hz) {
  const LinearPlant linear = linearize(without_vibrations(plant), smoothing);
  refuse_unreadable(linear);
  bool lagging = false;
  plant_ = without_motor_lag(linear, lagging);
  const ControllablePart part = controllable_part(plant_);
  const SampledProblem problem = sample_problem(part.a, part.b * plant_.actuator_slope,
                                                weight_matrix(plant_, weights), weights.r, 1.0 / rate_hz);
  a_ = problem.a;
  b_ = problem.b;
  q_ = problem.q;
  s_ = problem.s;
  r_ = problem.r;
  smallest_ = solve_discrete_riccati(a_, b_, q_, s_, MatrixXd::Constant(1, 1, r_)).x;
}

/// k in u = k x.
RowVectorXd GainCost::feedback(const std::array<double, 4>& gains) const {
  RowVectorXd k(a_.rows());
  for (Index i = 0; i < k.size(); ++i)
    k(i) = gains[plant_.fed_back[static_cast<std::size_t>(i)]] * plant_.sensor_scale(i);
  return k;
}

std::vector<std::complex<double>> GainCost::closed_loop_poles(const std::array<double, 4>& gains) const {
  return poles_of(a_ + b_ * feedback(gains), rate_hz_);
}

double GainCost::loss(const std::array<double, 4>& gains) const {
  const RowVectorXd k = feedback(gains);
  const MatrixXd closed = a_ + b_ * k;
  const MatrixXd each = q_ + s_ * k + k.transpose() * s_.transpose() + r_ * k.transpose() * k;
  const std::optional<MatrixXd> cost = discrete_lyapunov(closed, each);
  if (!cost) return std::numeric_limits<double>::infinity();
  const Eigen::VectorXcd ratios = eigenvalues(inverse(smallest_) * *cost);
  return ratios.real().maxCoeff() - 1.0;
}

}  // namespace upright
