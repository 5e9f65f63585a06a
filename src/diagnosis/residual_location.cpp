#include "residual_location.hpp"

#include <array>
#include <cmath>
#include <numeric>

#include "estimation/smoother.hpp"
#include "model/dense_algebra.hpp"
#include "reversal.hpp"

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

using Features = std::array<double, feature_count>;

/// Block means of residuals and features.
struct Rows {
  std::vector<Features> features;
  std::vector<double> force, torque;
  std::vector<std::size_t> fold;
};

/// Follows one segment and says what each feature is at a sample.
class FeatureState {
 public:
  explicit FeatureState(const MotionPolicy& policy) : policy_(policy) {}

  Features at(const ResidualTrace& trace, std::size_t k, const Measurement& run, std::size_t first) {
    const double dt = k > 0 ? trace.time_s[k] - trace.time_s[k - 1] : 0.0;
    const double v = trace.cart_mps[k], direction = direction_of(v, policy_.still_cart_mps);
    motion_.pass(direction, dt);
    voltage_.pass(direction_of(trace.voltage_v[k], policy_.no_voltage_v), dt);
    const double theta = run.has_theta() ? run.theta_rad[first + k] : 0.0;
    const double omega =
        run.has_theta() && k > 0 && dt > 0.0 ? (theta - run.theta_rad[first + k - 1]) / dt : 0.0;
    const double t = trace.time_s[k] - run.time_s.front();
    const double turn = direction_of(omega, policy_.still_pendulum_radps);
    return {1.0,
            v,
            v * std::abs(v),
            direction,
            trace.cart_m[k],
            trace.cart_m[k] * direction,
            trace.voltage_v[k],
            t,
            t * direction,
            motion_.fading(policy_.fading_after_motion_s),
            motion_.fading(policy_.slow_fading_after_motion_s),
            voltage_.fading(policy_.fading_after_voltage_s),
            std::sin(theta),
            omega,
            turn,
            t * turn};
  }

 private:
  const MotionPolicy& policy_;
  Reversal motion_, voltage_;
};

Rows collect(const FitData& data, const std::vector<ResidualTrace>& traces, const SelectionPolicy& policy) {
  Rows rows;
  for (std::size_t s = 0; s < traces.size(); ++s) {
    const ResidualTrace& trace = traces[s];
    const Measurement& run = (*data.runs)[trace.run];
    FeatureState state(policy.motion);
    Features sum{};
    double force = 0.0, torque = 0.0, count = 0.0, block_start = trace.time_s.front();
    for (std::size_t k = 0; k < trace.time_s.size(); ++k) {
      const Features now = state.at(trace, k, run, data.segments[s].first);
      for (std::size_t i = 0; i < feature_count; ++i) sum[i] += now[i];
      force += trace.force_n[k];
      torque += trace.torque_nm[k];
      count += 1.0;
      if (trace.time_s[k] - block_start < policy.location.block_s) continue;
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
/// y. The share is negative where they predict worse than nothing, and zero where y is.
std::pair<double, std::size_t> explained_share(const Rows& rows, const std::vector<double>& y,
                                               const LocationPolicy& policy) {
  const std::size_t n = y.size();
  if (n < policy.rows_per_feature * feature_count) return {0.0, 0};
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
    train.diagonal().array() += policy.ridge * static_cast<double>(n);
    const Vector weights = solve_symmetric(train, all_g - g[f]);
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

}  // namespace

ResidualLocation locate_residual(const FitData& data, const FitPoint& point, const SelectionPolicy& policy) {
  const Rows rows = collect(data, smooth_residuals(data, point, policy.location.walk), policy);
  const auto [force_share, force_feature] = explained_share(rows, rows.force, policy.location);
  const auto [torque_share, torque_feature] = explained_share(rows, rows.torque, policy.location);
  if (!(std::max(force_share, torque_share) > 0.0)) return {};
  if (force_share >= torque_share) return {false, force_share, feature_names[force_feature]};
  return {true, torque_share, feature_names[torque_feature]};
}

}  // namespace upright
