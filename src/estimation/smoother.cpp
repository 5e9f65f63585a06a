#include "smoother.hpp"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>

#include "base/parallel.hpp"
#include "state_vector.hpp"

namespace upright {

namespace {

constexpr int extended = state_count + 2;  // and the residual force and torque
using Vector = Eigen::Matrix<double, extended, 1>;
using Matrix = Eigen::Matrix<double, extended, extended>;

struct Filtered {
  Vector mean, predicted_mean;
  Matrix covariance, predicted_covariance, transition;
};

Matrix transition_of(const LinearStep& step) {
  Matrix a = Matrix::Identity();
  for (int i = 0; i < state_count; ++i)
    for (int j = 0; j < state_count; ++j) a(i, j) = step.transition[i][j];
  // A force that lasts over the period enters through the velocities, which the transition then carries on.
  for (int i = 0; i < state_count; ++i) {
    a(i, state_count) =
        (step.transition[i][2] * step.by_force[0] + step.transition[i][3] * step.by_force[1]) * step.period_s;
    a(i, state_count + 1) =
        (step.transition[i][2] * step.by_torque[0] + step.transition[i][3] * step.by_torque[1]) *
        step.period_s;
  }
  return a;
}

/// What is measured of a segment, and how well.
struct Channels {
  std::array<bool, 2> present;
  std::array<double, 2> variance;
};

/// The filter forwards along the steps of a segment.
std::vector<Filtered> filter(const std::vector<LinearStep>& steps, const Channels& channels,
                             const ResidualWalk& walk) {
  const double wander_force = walk.force_n_per_sqrt_s, wander_torque = walk.torque_nm_per_sqrt_s;
  std::vector<Filtered> passes(steps.size());
  Vector mean = Vector::Zero(), corrected = Vector::Zero();
  Matrix p = Matrix::Zero();
  p.diagonal() = Eigen::Map<const Vector>(walk.start_variances.data());
  for (std::size_t k = 0; k < steps.size(); ++k) {
    Filtered& f = passes[k];
    f.transition = k == 0 ? Matrix::Identity() : transition_of(steps[k]);
    if (k > 0) {
      mean = f.transition * (mean - corrected);
      p = f.transition * p * f.transition.transpose();
      p(state_count, state_count) += wander_force * wander_force * steps[k].period_s;
      p(state_count + 1, state_count + 1) += wander_torque * wander_torque * steps[k].period_s;
    }
    // The trajectory that the steps are linearised along was itself corrected by a filter: errors are
    // counted from there.
    for (int i = 0; i < state_count; ++i) corrected[i] = steps[k].correction[i];
    f.predicted_mean = mean;
    f.predicted_covariance = p;
    for (std::size_t channel = 0; channel < 2; ++channel) {
      if (!channels.present[channel]) continue;
      const auto at = static_cast<Eigen::Index>(channel);
      const double c = steps[k].gain[channel];
      const double innovation_variance = c * c * p(at, at) + channels.variance[channel];
      const Vector gain = c * p.col(at) / innovation_variance;
      mean += gain * (steps[k].residual[channel] - c * mean[at]);
      p -= gain * (c * p.row(at));
    }
    f.mean = mean;
    f.covariance = p;
  }
  return passes;
}

/// The smoother backwards: the errors of each sample, for the whole segment.
std::vector<Vector> smooth(const std::vector<Filtered>& passes) {
  const std::size_t n = passes.size();
  std::vector<Vector> smoothed(n);
  Vector value = passes.back().mean;
  for (std::size_t k = n; k-- > 0;) {
    if (k + 1 < n) {
      const Filtered& next = passes[k + 1];
      Matrix ahead = next.predicted_covariance;
      ahead.diagonal().array() += 1e-14;
      const Matrix gain = ahead.ldlt().solve(next.transition * passes[k].covariance).transpose();
      value = passes[k].mean + gain * (value - next.predicted_mean);
    }
    smoothed[k] = value;
  }
  return smoothed;
}

}  // namespace

std::vector<ResidualTrace> smooth_residuals(const FitData& data, const FitPoint& point,
                                            const ResidualWalk& walk) {
  const std::vector<std::vector<LinearStep>> all = linearise(data, point);
  std::vector<ResidualTrace> traces(all.size());
  parallel_for(all.size(), [&](std::size_t s) {
    const std::vector<LinearStep>& steps = all[s];
    const Segment& segment = data.segments[s];
    const Measurement& run = (*data.runs)[segment.run];
    const std::array<bool, 2> present = {run.has_cart(), run.has_theta() && point.plant.pendulum.has_value()};
    const Channels channels{present,
                            {present[0] ? std::pow(run.cart_noise_m(), 2) : 1.0,
                             present[1] ? std::pow(run.theta_noise_rad(), 2) : 1.0}};
    const std::vector<Vector> smoothed = smooth(filter(steps, channels, walk));
    ResidualTrace& trace = traces[s];
    trace.run = segment.run;
    for (std::size_t k = 0; k < steps.size(); ++k) {
      trace.time_s.push_back(run.time_s[segment.first + k]);
      trace.force_n.push_back(smoothed[k][state_count]);
      trace.torque_nm.push_back(smoothed[k][state_count + 1]);
      trace.cart_m.push_back(present[0] ? run.cart_m[segment.first + k] : 0.0);
      trace.cart_mps.push_back(steps[k].rate[0] + smoothed[k][2]);
      trace.voltage_v.push_back(run.voltage_v[segment.first + k]);
    }
  });
  return traces;
}

}  // namespace upright
