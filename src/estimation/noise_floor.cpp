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

/// What a fit of the initial state takes out of the residuals of a segment: the same for all draws.
class InitialStateFit {
 public:
  InitialStateFit(const std::vector<LinearStep>& steps, const std::array<bool, 2>& present) {
    Transition since_start = Transition::Identity(), information = Transition::Zero();
    for (const LinearStep& step : steps) {
      since_start = Eigen::Map<const Transition>(&step.transition[0][0]) * since_start;
      for (int channel = 0; channel < 2; ++channel) {
        if (!present[static_cast<std::size_t>(channel)]) continue;
        const State row = step.gain[channel] * since_start.row(channel).transpose();
        const double weight = step.weight[channel] / step.variance[channel];
        information += weight * row * row.transpose();
        rows_.push_back(row);
        weights_.push_back(weight);
        count_ += step.weight[channel];
      }
    }
    scale_ = information.diagonal().unaryExpr([](double v) { return v > 0.0 ? 1.0 / std::sqrt(v) : 0.0; });
    Transition unit = scale_.asDiagonal() * information * scale_.asDiagonal();
    unit.diagonal().array() += 1e-9;
    solver_.compute(unit);
  }

  /// The weighted sum of squares that is left of these residuals, in the order of steps and channels.
  double left_of(const std::vector<double>& residuals) const {
    State score = State::Zero();
    for (std::size_t k = 0; k < residuals.size(); ++k) score += weights_[k] * residuals[k] * rows_[k];
    const State fitted = scale_.asDiagonal() * State(solver_.solve(State(scale_.asDiagonal() * score)));
    double sum = 0.0;
    for (std::size_t k = 0; k < residuals.size(); ++k) {
      const double left = residuals[k] - rows_[k].dot(fitted);
      sum += weights_[k] * left * left;
    }
    return sum;
  }
  /// How many measurements there are, weighted.
  double count() const { return count_; }

 private:
  std::vector<State> rows_;  ///< derivatives of the residuals with respect to the initial state
  std::vector<double> weights_;
  State scale_;
  Eigen::LDLT<Transition> solver_;
  double count_ = 0.0;
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

/// One draw of the noise along a segment: the residuals that it causes.
void draw(const std::vector<LinearStep>& steps, const std::array<bool, 2>& present, const Noise& noise,
          std::mt19937_64& random, std::vector<double>& residuals) {
  std::normal_distribution<double> normal;
  State error = State::Zero();
  double coloured[] = {noise.coloured_force_n * normal(random), noise.coloured_torque_nm * normal(random)};
  residuals.clear();
  for (const LinearStep& step : steps) {
    const double root = std::sqrt(step.period_s);
    const double force = noise.force * root * normal(random), torque = noise.torque * root * normal(random);
    error[2] += step.by_force[0] * force + step.by_torque[0] * torque;
    error[3] += step.by_force[1] * force + step.by_torque[1] * torque;
    advance_coloured(step, noise, coloured, error, [&] { return normal(random); });
    error = State(Eigen::Map<const Transition>(&step.transition[0][0]) * error);
    for (int channel = 0; channel < 2; ++channel) {
      if (!present[static_cast<std::size_t>(channel)]) continue;
      const double sensor = noise.sensors * std::sqrt(step.variance[channel]) * normal(random);
      residuals.push_back(step.gain[channel] * error[channel] + sensor);
    }
  }
}

}  // namespace

SimulationFloor simulation_floor(const FitData& data, const FitPoint& point, std::size_t draws) {
  FitPoint plain = point;
  plain.noise = sensors_only(plain.noise);
  const std::vector<std::vector<LinearStep>> steps = linearise(data, plain);
  const auto present = [&](std::size_t s) {
    const Measurement& run = (*data.runs)[data.segments[s].run];
    return std::array<bool, 2>{run.has_cart(), run.has_theta() && point.plant.pendulum.has_value()};
  };
  std::vector<InitialStateFit> fits;
  fits.reserve(steps.size());
  double count = 0.0;
  for (std::size_t s = 0; s < steps.size(); ++s) {
    fits.emplace_back(steps[s], present(s));
    count += fits.back().count();
  }
  if (!(count > 0.0)) return {};
  std::vector<double> sums(draws, 0.0);
  parallel_for(draws, [&](std::size_t i) {
    std::mt19937_64 random(i + 1);
    std::vector<double> residuals;
    for (std::size_t s = 0; s < steps.size(); ++s) {
      draw(steps[s], present(s), point.noise, random, residuals);
      sums[i] += fits[s].left_of(residuals);
    }
  });
  std::sort(sums.begin(), sums.end());
  const auto as_rms = [&](double sum) { return std::max(1.0, std::sqrt(sum / count)); };
  return {as_rms(sums[draws / 2]), as_rms(sums[draws - 1])};
}

}  // namespace upright
