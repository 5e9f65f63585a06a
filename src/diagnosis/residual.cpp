#include "residual.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"

namespace upright {

namespace {

constexpr int states = LinearStep::states;
constexpr int extended = states + 2;  // and the residual force and torque
using Vector = Eigen::Matrix<double, extended, 1>;
using Matrix = Eigen::Matrix<double, extended, extended>;

struct Filtered {
  Vector mean, predicted_mean, corrected;
  Matrix covariance, predicted_covariance, transition;
};

Matrix transition_of(const LinearStep& step) {
  Matrix a = Matrix::Identity();
  for (int i = 0; i < states; ++i)
    for (int j = 0; j < states; ++j) a(i, j) = step.transition[i][j];
  // A force that lasts over the period enters through the velocities, which the transition then carries on.
  for (int i = 0; i < states; ++i) {
    a(i, states) =
        (step.transition[i][2] * step.by_force[0] + step.transition[i][3] * step.by_force[1]) * step.period_s;
    a(i, states + 1) =
        (step.transition[i][2] * step.by_torque[0] + step.transition[i][3] * step.by_torque[1]) *
        step.period_s;
  }
  return a;
}

}  // namespace

std::vector<ResidualTrace> smooth_residuals(const FitData& data, const FitPoint& point) {
  const std::vector<std::vector<LinearStep>> all = linearise(data, point);
  std::vector<ResidualTrace> traces(all.size());
  parallel_for(all.size(), [&](std::size_t s) {
    const std::vector<LinearStep>& steps = all[s];
    const Segment& segment = data.segments[s];
    const Measurement& run = (*data.runs)[segment.run];
    // How fast the residual may wander: across its whole size within a few hundredths of a second.
    constexpr double wander_force = 3.0, wander_torque = 0.3;  // per root second
    const bool channels[2] = {run.has_cart(), run.has_theta() && point.plant.pendulum.has_value()};
    const double variance[2] = {channels[0] ? std::pow(run.cart_noise_m(), 2) : 1.0,
                                channels[1] ? std::pow(run.theta_noise_rad(), 2) : 1.0};
    std::vector<Filtered> passes(steps.size());
    Vector mean = Vector::Zero(), corrected = Vector::Zero();
    Matrix p = Matrix::Zero();
    p.diagonal() << 1e-6, 1e-4, 1e-2, 1e-1, 1e-6, 4.0, 0.04;
    for (std::size_t k = 0; k < steps.size(); ++k) {
      Filtered& f = passes[k];
      f.transition = k == 0 ? Matrix::Identity() : transition_of(steps[k]);
      if (k > 0) {
        mean = f.transition * (mean - corrected);
        p = f.transition * p * f.transition.transpose();
        p(states, states) += wander_force * wander_force * steps[k].period_s;
        p(states + 1, states + 1) += wander_torque * wander_torque * steps[k].period_s;
      }
      // The trajectory that the steps are linearised along was itself corrected by a filter: errors are
      // counted from there.
      corrected.setZero();
      for (int channel = 0; channel < 2; ++channel) {
        if (!channels[channel]) continue;
        const double e = steps[k].residual[channel] - steps[k].gain[channel] * corrected[channel];
        for (int i = 0; i < states; ++i) corrected[i] += steps[k].update[channel][i] * e;
      }
      f.corrected = corrected;
      f.predicted_mean = mean;
      f.predicted_covariance = p;
      for (int channel = 0; channel < 2; ++channel) {
        if (!channels[channel]) continue;
        const double c = steps[k].gain[channel];
        const double innovation_variance = c * c * p(channel, channel) + variance[channel];
        const Vector gain = c * p.col(channel) / innovation_variance;
        mean += gain * (steps[k].residual[channel] - c * mean[channel]);
        p -= gain * (c * p.row(channel));
      }
      f.mean = mean;
      f.covariance = p;
    }
    ResidualTrace& trace = traces[s];
    trace.run = segment.run;
    const auto n = steps.size();
    for (auto* values :
         {&trace.time_s, &trace.force_n, &trace.torque_nm, &trace.cart_m, &trace.cart_mps, &trace.voltage_v})
      values->resize(n);
    Vector smooth = passes.back().mean;
    for (std::size_t k = n; k-- > 0;) {
      if (k + 1 < n) {
        const Filtered& next = passes[k + 1];
        Matrix ahead = next.predicted_covariance;
        ahead.diagonal().array() += 1e-14;
        const Matrix gain = ahead.ldlt().solve(next.transition * passes[k].covariance).transpose();
        smooth = passes[k].mean + gain * (smooth - next.predicted_mean);
      }
      trace.time_s[k] = run.time_s[segment.first + k];
      trace.force_n[k] = smooth[states];
      trace.torque_nm[k] = smooth[states + 1];
      trace.cart_m[k] = channels[0] ? run.cart_m[segment.first + k] : 0.0;
      trace.cart_mps[k] = steps[k].rate[0] + smooth[2];
      trace.voltage_v[k] = run.voltage_v[segment.first + k];
    }
  });
  return traces;
}

}  // namespace upright
