#include "noise_floor.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "base/parallel.hpp"
#include "state_vector.hpp"

namespace upright {

namespace {

using State = Eigen::Matrix<double, state_count, 1>;
using Transition = Eigen::Matrix<double, state_count, state_count, Eigen::RowMajor>;

/// Least squares of the initial state over residuals, to take out what a fit of it would.
class InitialStateFit {
 public:
  void add(const State& row, double residual, double weight) {
    information_ += weight * row * row.transpose();
    score_ += weight * residual * row;
  }
  State solve() const {
    const State scale =
        information_.diagonal().unaryExpr([](double v) { return v > 0.0 ? 1.0 / std::sqrt(v) : 0.0; });
    Transition unit = scale.asDiagonal() * information_ * scale.asDiagonal();
    unit.diagonal().array() += 1e-9;
    return scale.asDiagonal() * State(unit.ldlt().solve(State(scale.asDiagonal() * score_)));
  }

 private:
  Transition information_ = Transition::Zero();
  State score_ = State::Zero();
};

struct Shown {
  State row;  ///< d residual / d initial state
  double residual, weight;
};

/// Pushes with the coloured disturbances over a period, and draws those of the next one.
template <class Normal>
void advance_coloured(const LinearStep& step, const Noise& noise, double (&coloured)[2], State& error,
                      Normal normal) {
  const double sigma[] = {noise.coloured_force_n, noise.coloured_torque_nm};
  const double keeps = std::exp(-step.period_s / noise.correlation_s);
  for (int d = 0; d < LinearStep::disturbances; ++d) {
    if (sigma[d] == 0.0) continue;
    error[2] += step.impulse[d][0] * coloured[d];
    error[3] += step.impulse[d][1] * coloured[d];
    coloured[d] = keeps * coloured[d] + sigma[d] * std::sqrt(1.0 - keeps * keeps) * normal();
  }
}

/// One draw of the noise along a segment: the sum of squares that is left, and of how many numbers.
std::array<double, 2> draw(const std::vector<LinearStep>& steps, const std::array<bool, 2>& present,
                           const Noise& noise, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  State error = State::Zero();
  double coloured[] = {noise.coloured_force_n * normal(random), noise.coloured_torque_nm * normal(random)};
  Transition since_start = Transition::Identity();
  InitialStateFit start;
  std::vector<Shown> all;
  for (const LinearStep& step : steps) {
    const double root = std::sqrt(step.period_s);
    const double force = noise.force * root * normal(random), torque = noise.torque * root * normal(random);
    error[2] += step.by_force[0] * force + step.by_torque[0] * torque;
    error[3] += step.by_force[1] * force + step.by_torque[1] * torque;
    advance_coloured(step, noise, coloured, error, [&] { return normal(random); });
    const Eigen::Map<const Transition> transition(&step.transition[0][0]);
    error = transition * error;
    since_start = transition * since_start;
    for (int channel = 0; channel < 2; ++channel) {
      if (!present[static_cast<std::size_t>(channel)]) continue;
      const double sensor = noise.sensors * std::sqrt(step.variance[channel]) * normal(random);
      const double weight = step.weight[channel] / step.variance[channel];
      const Shown shown{step.gain[channel] * since_start.row(channel).transpose(),
                        step.gain[channel] * error[channel] + sensor, weight};
      start.add(shown.row, shown.residual, shown.weight);
      all.push_back(shown);
    }
  }
  const State fitted = start.solve();
  std::array<double, 2> sums{};
  std::size_t k = 0;
  for (const LinearStep& step : steps)
    for (int channel = 0; channel < 2; ++channel) {
      if (!present[static_cast<std::size_t>(channel)]) continue;
      const Shown& shown = all[k++];
      const double left = shown.residual - shown.row.dot(fitted);
      sums[0] += shown.weight * left * left;
      sums[1] += step.weight[channel];
    }
  return sums;
}

}  // namespace

SimulationFloor simulation_floor(const FitData& data, const FitPoint& point, std::size_t draws) {
  FitPoint plain = point;
  plain.noise = sensors_only(plain.noise);
  const std::vector<std::vector<LinearStep>> steps = linearise(data, plain);
  std::vector<double> sums(draws, 0.0);
  double count = 0.0;
  parallel_for(draws, [&](std::size_t i) {
    std::mt19937_64 random(i + 1);
    double counted = 0.0;
    for (std::size_t s = 0; s < steps.size(); ++s) {
      const Measurement& run = (*data.runs)[data.segments[s].run];
      const std::array<double, 2> drawn =
          draw(steps[s], {run.has_cart(), run.has_theta() && point.plant.pendulum.has_value()}, point.noise,
               random);
      sums[i] += drawn[0];
      counted += drawn[1];
    }
    if (i == 0) count = counted;
  });
  if (!(count > 0.0)) return {};
  std::sort(sums.begin(), sums.end());
  const auto as_rms = [&](double sum) { return std::max(1.0, std::sqrt(sum / count)); };
  return {as_rms(sums[draws / 2]), as_rms(sums[draws - 1])};
}

}  // namespace upright
