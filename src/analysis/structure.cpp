#include "upright/analysis/structure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "upright/analysis/residual.hpp"

namespace upright {

namespace {

constexpr std::array feature_names = {"its mean",
                                      "velocity",
                                      "velocity squared",
                                      "direction of motion",
                                      "position",
                                      "position and direction",
                                      "voltage",
                                      "time",
                                      "time and direction of motion",
                                      "the time after a reversal of motion",
                                      "the time after a reversal of motion",
                                      "the time after a reversal of voltage",
                                      "the angle",
                                      "the pendulum's rate",
                                      "direction of the pendulum",
                                      "time and direction of the pendulum"};
constexpr std::size_t feature_count = feature_names.size();

double sign(double v, double dead) {
  return v > dead ? 1.0 : v < -dead ? -1.0 : 0.0;
}

struct Rows {
  std::vector<std::array<double, feature_count>> features;
  std::vector<double> force, torque;
  std::vector<std::size_t> fold;
};

/// Block means of residuals and features: shorter than an effect takes, longer than the smoother's memory.
Rows collect(const FitData& data, const std::vector<ResidualTrace>& traces) {
  constexpr double block_s = 0.03;
  Rows rows;
  for (std::size_t s = 0; s < traces.size(); ++s) {
    const ResidualTrace& trace = traces[s];
    const Measurement& run = (*data.runs)[trace.run];
    const Segment& segment = data.segments[s];
    double since_motion = 1.0, since_voltage = 1.0, last_direction = 0.0, last_voltage = 0.0;
    std::array<double, feature_count> sum{};
    double force = 0.0, torque = 0.0, count = 0.0, block_start = trace.time_s.front();
    for (std::size_t k = 0; k < trace.time_s.size(); ++k) {
      const double dt = k > 0 ? trace.time_s[k] - trace.time_s[k - 1] : 0.0;
      since_motion += dt;
      since_voltage += dt;
      const double v = trace.cart_mps[k], direction = sign(v, 2e-3), volts = sign(trace.voltage_v[k], 0.02);
      if (direction != 0.0 && direction != last_direction) since_motion = 0.0;
      if (volts != 0.0 && volts != last_voltage) since_voltage = 0.0;
      if (direction != 0.0) last_direction = direction;
      if (volts != 0.0) last_voltage = volts;
      const double theta = run.has_theta() ? run.theta_rad[segment.first + k] : 0.0;
      const double omega =
          run.has_theta() && k > 0 && dt > 0.0 ? (theta - run.theta_rad[segment.first + k - 1]) / dt : 0.0;
      const double t = trace.time_s[k] - run.time_s.front();
      const double omega_sign = sign(omega, 0.02);
      const std::array<double, feature_count> now = {1.0,
                                                     v,
                                                     v * std::abs(v),
                                                     direction,
                                                     trace.cart_m[k],
                                                     trace.cart_m[k] * direction,
                                                     trace.voltage_v[k],
                                                     t,
                                                     t * direction,
                                                     std::exp(-since_motion / 0.03) * last_direction,
                                                     std::exp(-since_motion / 0.15) * last_direction,
                                                     std::exp(-since_voltage / 0.05) * last_voltage,
                                                     std::sin(theta),
                                                     omega,
                                                     omega_sign,
                                                     t * omega_sign};
      for (std::size_t i = 0; i < feature_count; ++i) sum[i] += now[i];
      force += trace.force_n[k];
      torque += trace.torque_nm[k];
      count += 1.0;
      if (trace.time_s[k] - block_start < block_s) continue;
      for (double& value : sum) value /= count;
      rows.features.push_back(sum);
      rows.force.push_back(force / count);
      rows.torque.push_back(torque / count);
      rows.fold.push_back(s);
      sum.fill(0.0);
      force = torque = count = 0.0;
      block_start = trace.time_s[k];
    }
  }
  return rows;
}

/// Cross-validated share of the variance of y that the features predict, and the feature most correlated with
/// y.
std::pair<double, std::size_t> explained_share(const Rows& rows, const std::vector<double>& y) {
  const std::size_t n = y.size();
  if (n < 4 * feature_count) return {0.0, 0};
  std::array<double, feature_count> scale{};
  for (const auto& row : rows.features)
    for (std::size_t i = 0; i < feature_count; ++i) scale[i] += row[i] * row[i] / static_cast<double>(n);
  for (double& value : scale) value = value > 1e-20 ? 1.0 / std::sqrt(value) : 0.0;
  using Matrix = Eigen::Matrix<double, feature_count, feature_count>;
  using Vector = Eigen::Matrix<double, feature_count, 1>;
  constexpr std::size_t folds = 8;
  std::array<Matrix, folds> h;
  std::array<Vector, folds> g;
  h.fill(Matrix::Zero());
  g.fill(Vector::Zero());
  const auto row_of = [&](std::size_t k) {
    Vector row;
    for (std::size_t i = 0; i < feature_count; ++i)
      row[static_cast<Eigen::Index>(i)] = rows.features[k][i] * scale[i];
    return row;
  };
  for (std::size_t k = 0; k < n; ++k) {
    const Vector row = row_of(k);
    h[rows.fold[k] % folds] += row * row.transpose();
    g[rows.fold[k] % folds] += row * y[k];
  }
  const Matrix all_h = std::accumulate(h.begin(), h.end(), Matrix(Matrix::Zero()));
  const Vector all_g = std::accumulate(g.begin(), g.end(), Vector(Vector::Zero()));
  double left = 0.0, total = 0.0;
  for (std::size_t f = 0; f < folds; ++f) {
    Matrix train = all_h - h[f];
    train.diagonal().array() += 0.01 * static_cast<double>(n);
    const Vector weights = train.ldlt().solve(all_g - g[f]);
    for (std::size_t k = 0; k < n; ++k) {
      if (rows.fold[k] % folds != f) continue;
      const double off = y[k] - row_of(k).dot(weights);
      left += off * off;
      total += y[k] * y[k];
    }
  }
  std::size_t best = 0;
  for (std::size_t i = 1; i < feature_count; ++i)
    if (std::abs(all_g[static_cast<Eigen::Index>(i)]) > std::abs(all_g[static_cast<Eigen::Index>(best)]))
      best = i;
  return {total > 0.0 ? 1.0 - left / total : 0.0, best};
}

/// Fourth moment over the square of the second: 3 for a Gaussian, more where a residual comes in bursts.
/// Blocks at rest do not count, since friction hides the force there.
double kurtosis_of(const std::vector<double>& y, const Rows& rows, std::size_t speed_feature) {
  double second = 0.0, fourth = 0.0, count = 0.0;
  for (std::size_t k = 0; k < y.size(); ++k) {
    if (std::abs(rows.features[k][speed_feature]) < 2e-3) continue;
    second += y[k] * y[k];
    fourth += y[k] * y[k] * y[k] * y[k];
    count += 1.0;
  }
  return count > 50.0 && second > 0.0 ? fourth * count / (second * second) : 3.0;
}

}  // namespace

ResidualStructure examine_residuals(const FitData& data, const FitPoint& point) {
  ResidualStructure result;
  const std::vector<std::vector<LinearStep>> steps = linearise(data, point);
  std::vector<double> blocks;
  for (std::size_t s = 0; s < steps.size(); ++s) {
    const Measurement& run = (*data.runs)[data.segments[s].run];
    const bool present[2] = {run.has_cart(), run.has_theta() && point.plant.pendulum.has_value()};
    constexpr double block_s = 0.15;
    const double period = run.median_period_s();
    const auto length = static_cast<std::size_t>(std::max(20.0, block_s / period));
    for (std::size_t first = 0; first + length <= steps[s].size(); first += length) {
      double sum = 0.0, count = 0.0;
      for (std::size_t k = first; k < first + length; ++k) {
        double update[LinearStep::states] = {};
        for (int channel = 0; channel < 2; ++channel) {
          if (!present[channel]) continue;
          const double e = steps[s][k].residual[channel] - steps[s][k].gain[channel] * update[channel];
          for (int i = 0; i < LinearStep::states; ++i) update[i] += steps[s][k].update[channel][i] * e;
          sum += e * e / steps[s][k].variance[channel];
          count += 1.0;
        }
      }
      blocks.push_back(std::sqrt(sum / std::max(count, 1.0)));
    }
  }
  if (blocks.size() >= 20) {
    std::sort(blocks.begin(), blocks.end());
    result.dispersion = blocks[blocks.size() * 95 / 100] / std::max(blocks[blocks.size() / 2], 1e-12);
  }
  const Rows rows = collect(data, smooth_residuals(data, point));
  const auto [force_share, force_feature] = explained_share(rows, rows.force);
  const auto [torque_share, torque_feature] = explained_share(rows, rows.torque);
  result.force_tails = kurtosis_of(rows.force, rows, 1);
  result.force_explained = force_share;
  result.torque_explained = torque_share;
  result.force_feature = feature_names[force_feature];
  result.torque_feature = feature_names[torque_feature];
  return result;
}

}  // namespace upright
