#include "force_balance.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/rigid_body.hpp"

namespace upright {

namespace {

constexpr double cutoff_hz = 30.0;
constexpr double rest_window_s = 0.05;

/// Second-order Butterworth low-pass, forwards and backwards: no phase.
std::vector<double> smooth(const std::vector<double>& values, double period_s) {
  const double warped = std::tan(std::numbers::pi * std::min(cutoff_hz * period_s, 0.2));
  const double q = std::numbers::sqrt2;
  const double norm = 1.0 / (1.0 + q * warped + warped * warped);
  const double b0 = warped * warped * norm, a1 = 2.0 * (warped * warped - 1.0) * norm,
               a2 = (1.0 - q * warped + warped * warped) * norm;
  std::vector<double> result = values;
  const auto pass = [&](auto begin, auto end) {
    // Starts as if the first value had been there for ever.
    double x1 = *begin, x2 = *begin, y1 = *begin, y2 = *begin;
    for (auto at = begin; at != end; ++at) {
      const double x = *at;
      const double y = b0 * (x + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
      x2 = x1;
      x1 = x;
      y2 = y1;
      y1 = y;
      *at = y;
    }
  };
  if (result.empty()) return result;
  pass(result.begin(), result.end());
  pass(result.rbegin(), result.rend());
  return result;
}

std::vector<double> derivative(const std::vector<double>& values, const std::vector<double>& time) {
  std::vector<double> result(values.size(), 0.0);
  for (std::size_t k = 1; k + 1 < values.size(); ++k)
    result[k] = (values[k + 1] - values[k - 1]) / (time[k + 1] - time[k - 1]);
  if (values.size() > 2) {
    result.front() = result[1];
    result.back() = result[values.size() - 2];
  }
  return result;
}

/// Raw, unfiltered: the force a voltage that is held makes at each sample (the mean of before and after).
std::vector<double> motor_force(const Measurement& run, const Plant& plant) {
  std::vector<double> force(run.size());
  for (std::size_t k = 0; k < run.size(); ++k)
    force[k] = plant.motor.force_per_volt_n * 0.5 * (run.voltage_v[k] + run.voltage_v[k > 0 ? k - 1 : 0]);
  return force;
}

}  // namespace

ForceTrace force_trace(const Measurement& run, const Plant& plant) {
  ForceTrace trace;
  const double period = run.median_period_s();
  trace.time_s = run.time_s;
  const std::vector<double> x = smooth(run.cart_m, period);
  trace.cart_mps = derivative(x, run.time_s);
  trace.cart_mps2 = derivative(trace.cart_mps, run.time_s);
  trace.force_n = smooth(motor_force(run, plant), period);
  const RigidBody body = rigid_body(plant);
  if (run.has_theta() && body.moment_kgm > 0.0) {
    const std::vector<double> theta = smooth(run.theta_rad, period);
    const std::vector<double> rate = derivative(theta, run.time_s);
    const std::vector<double> acceleration = derivative(rate, run.time_s);
    for (std::size_t k = 0; k < theta.size(); ++k)
      trace.force_n[k] -= body.moment_kgm *
                          pendulum_reaction(std::sin(theta[k]), std::cos(theta[k]), rate[k], acceleration[k]);
  }
  trace.friction_n.resize(x.size());
  for (std::size_t k = 0; k < x.size(); ++k)
    trace.friction_n[k] = trace.force_n[k] - body.mass_kg * trace.cart_mps2[k] -
                          plant.motor.back_emf_n_per_mps * trace.cart_mps[k];
  return trace;
}

namespace {

using Regressors = Eigen::Matrix<double, Eigen::Dynamic, 4>;

/// Acceleration, velocity, sign of the velocity, -1, force.
using Row = std::array<double, 5>;

/// The samples of a run in motion, decimated to what the filter lets through, so that rows are nearly
/// independent. The sign of the velocity passes the filter as every other term does, so that reversals count;
/// a cart at rest (slower than `slowest_mps`) does not, because its friction is whatever holds it.
void append_rows(const ForceTrace& t, double slowest_mps, std::vector<Row>& rows) {
  const double period = t.time_s.size() > 1 ? t.time_s[1] - t.time_s[0] : 1.0;
  const auto stride = std::max<std::size_t>(1, static_cast<std::size_t>(0.5 / (cutoff_hz * period)));
  const auto margin = static_cast<std::size_t>(0.03 / period) + 1;
  std::vector<double> signs;
  for (const double v : t.cart_mps) signs.push_back(v < 0.0 ? -1.0 : 1.0);
  signs = smooth(signs, period);
  // Slow for longer than a reversal takes: at rest, and the filter's reach around it.
  std::vector<bool> rests(t.time_s.size(), false);
  std::size_t since = 0;
  for (std::size_t k = 0; k < t.time_s.size(); ++k) {
    if (std::abs(t.cart_mps[k]) > slowest_mps) since = k + 1;
    if (static_cast<double>(k + 1 - since) * period < rest_window_s) continue;
    for (std::size_t j = since > margin ? since - margin : 0; j < std::min(k + margin, rests.size()); ++j)
      rests[j] = true;
  }
  for (std::size_t k = margin; k + margin < t.time_s.size(); k += stride)
    if (!rests[k]) rows.push_back({t.cart_mps2[k], t.cart_mps[k], signs[k], -1.0, t.force_n[k]});
}

/// Covariance of the score of a least-squares estimate whose residuals are autocorrelated (Newey and West,
/// Econometrica 55 (1987) 703, over half a second).
Eigen::Matrix4d score_covariance(const Regressors& a, const Eigen::VectorXd& residual) {
  const int lag = static_cast<int>(0.5 * 2.0 * cutoff_hz);
  Eigen::Matrix4d spread = Eigen::Matrix4d::Zero();
  for (int l = 0; l <= lag; ++l) {
    Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
    for (Eigen::Index i = l; i < residual.size(); ++i)
      sum += residual[i] * residual[i - l] * a.row(i).transpose() * a.row(i - l);
    const double weight = 1.0 - l / (lag + 1.0);
    spread += l == 0 ? sum : Eigen::Matrix4d(weight * (sum + sum.transpose()));
  }
  return spread;
}

}  // namespace

std::optional<ForceBalance> balance_forces(const std::vector<Measurement>& runs, const Plant& plant) {
  std::vector<Row> rows;
  double fastest = 0.0;
  std::vector<ForceTrace> traces;
  for (const Measurement& run : runs) {
    if (!run.has_cart()) continue;
    traces.push_back(force_trace(run, plant));
    for (const double v : traces.back().cart_mps) fastest = std::max(fastest, std::abs(v));
  }
  for (const ForceTrace& trace : traces) append_rows(trace, 0.01 * fastest, rows);
  if (rows.size() < 50) return std::nullopt;
  const auto n = static_cast<Eigen::Index>(rows.size());
  Regressors a(n, 4);
  Eigen::VectorXd f(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (int j = 0; j < 4; ++j) a(i, j) = rows[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
    f[i] = rows[static_cast<std::size_t>(i)][4];
  }
  const Eigen::Matrix4d information = a.transpose() * a;
  const Eigen::Matrix4d inverse = information.inverse();
  const Eigen::Vector4d p = inverse * (a.transpose() * f);
  const Eigen::VectorXd residual = f - a * p;
  const Eigen::Matrix4d spread = score_covariance(a, residual);
  const Eigen::Vector4d sigma = (inverse * spread * inverse).diagonal().cwiseMax(0.0).cwiseSqrt();
  ForceBalance balance;
  balance.mass_kg = p[0] - (plant.pendulum ? plant.pendulum->mass_kg : 0.0);
  balance.damping_n_per_mps = p[1];
  balance.coulomb_n = p[2];
  balance.constant_n = p[3];
  balance.mass_sigma = sigma[0];
  balance.damping_sigma = sigma[1];
  balance.coulomb_sigma = sigma[2];
  balance.constant_sigma = sigma[3];
  balance.relative_error = residual.norm() / f.norm();
  balance.rows = rows.size();
  return balance;
}

namespace {

/// A ramp is straight to this share of its rise: servos, pushes and jumps are not.
constexpr double straight_share = 0.2;
constexpr double slow_v_per_s = 1.5;

/// Whether the voltage of samples first..last is one slow ramp toward `direction`, all the way.
bool is_slow_ramp(const Measurement& run, std::size_t first, std::size_t last, double direction) {
  const double rise = run.voltage_v[last] - run.voltage_v[first];
  const double duration_s = run.time_s[last] - run.time_s[first];
  if (!(rise * direction > 0.0) || std::abs(rise) > slow_v_per_s * duration_s) return false;
  for (std::size_t k = first; k <= last; ++k) {
    const double straight_v = run.voltage_v[first] + rise * (run.time_s[k] - run.time_s[first]) / duration_s;
    if (std::abs(run.voltage_v[k] - straight_v) > straight_share * std::abs(rise)) return false;
  }
  return true;
}

bool rests(const Measurement& run, std::size_t first, std::size_t last, double within_m) {
  for (std::size_t k = first; k < last; ++k)
    if (std::abs(run.cart_m[k] - run.cart_m[last]) > within_m) return false;
  return true;
}

/// The force on the cart at a sample, the pendulum's reaction included.
double holding_force_n(const Measurement& run, const Plant& plant, std::size_t k, std::size_t rate_over) {
  const RigidBody body = rigid_body(plant);
  const double force = plant.motor.force_per_volt_n * run.voltage_v[k];
  if (!run.has_theta() || !(body.moment_kgm > 0.0)) return force;
  const double theta = run.theta_rad[k];
  const double rate =
      (run.theta_rad[k] - run.theta_rad[k - rate_over]) / (run.time_s[k] - run.time_s[k - rate_over]);
  const double sine = std::sin(theta), cosine = std::cos(theta);
  const double turning = pendulum_radps2(sine, cosine, 0.0, plant.gravity_mps2, body.equivalent_length_m());
  return force - body.moment_kgm * pendulum_reaction(sine, cosine, rate, turning);
}

}  // namespace

std::vector<Breakaway> find_breakaways(const std::vector<Measurement>& runs, const Plant& plant) {
  constexpr double rest_s = 0.5, window_s = 0.5;
  std::vector<Breakaway> found;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Measurement& run = runs[r];
    if (!run.has_cart()) continue;
    const double period = run.median_period_s();
    const double step = std::max(run.cart_resolution_m, 4.0 * run.cart_noise_m());
    const auto before = static_cast<std::size_t>(rest_s / period);
    const auto window = static_cast<std::size_t>(window_s / period);
    if (window < 10) continue;  // too few samples to tell rest from motion
    for (std::size_t k = before; k + window < run.size(); ++k) {
      // Gone: twenty steps further after the window; the onset is its first step.
      const double moved = run.cart_m[k + window] - run.cart_m[k];
      if (std::abs(moved) < 20.0 * step || !rests(run, k - before, k, 2.0 * step)) continue;
      std::size_t onset = k;
      while (onset < k + window && std::abs(run.cart_m[onset] - run.cart_m[k]) <= 1.5 * step) ++onset;
      // What made it go is the ramp that it rested under, and nothing that came between.
      if ((run.cart_m[onset] - run.cart_m[k]) * moved <= 0.0 ||
          !is_slow_ramp(run, k - before / 2, onset, moved))
        continue;
      found.push_back({r, run.time_s[onset], holding_force_n(run, plant, onset, window / 10)});
      k += window;
    }
  }
  return found;
}

namespace {

/// Speeds in equal parts of a stretch, and what noise makes of each.
struct PartSpeeds {
  double mean_mps = 0.0, lowest_mps = 0.0, highest_mps = 0.0, sigma_mps = 0.0;
};

/// Least squares of a line over each part of the samples first..first + length - 1.
PartSpeeds speeds_in_parts(const Measurement& run, std::size_t first, std::size_t length, std::size_t parts) {
  PartSpeeds speeds;
  const std::size_t n = length / parts;
  for (std::size_t part = 0; part < parts; ++part) {
    const std::size_t begin = first + part * n;
    double t_mean = 0.0, x_mean = 0.0, tt = 0.0, tx = 0.0;
    for (std::size_t k = begin; k < begin + n; ++k) {
      t_mean += run.time_s[k] / static_cast<double>(n);
      x_mean += run.cart_m[k] / static_cast<double>(n);
    }
    for (std::size_t k = begin; k < begin + n; ++k) {
      tt += (run.time_s[k] - t_mean) * (run.time_s[k] - t_mean);
      tx += (run.time_s[k] - t_mean) * (run.cart_m[k] - x_mean);
    }
    const double speed = tx / tt;
    speeds.mean_mps += speed / static_cast<double>(parts);
    speeds.lowest_mps = part == 0 ? speed : std::min(speeds.lowest_mps, speed);
    speeds.highest_mps = part == 0 ? speed : std::max(speeds.highest_mps, speed);
    speeds.sigma_mps = run.cart_noise_m() / std::sqrt(tt);
  }
  return speeds;
}

/// The same all along, but for what noise makes of it: with a change of 3 percent over 0.15 s inertia takes a
/// percent or two of what friction and back-EMF take.
bool is_steady(const PartSpeeds& speeds) {
  constexpr double share = 0.03, by_noise = 6.0, min_mps = 0.005;
  const double noise_mps = by_noise * speeds.sigma_mps;
  return std::abs(speeds.mean_mps) > std::max(min_mps, noise_mps) &&
         speeds.highest_mps - speeds.lowest_mps < share * std::abs(speeds.mean_mps) + noise_mps;
}

}  // namespace

std::vector<SteadyPoint> find_steady_points(const std::vector<Measurement>& runs, const Plant& plant) {
  constexpr double stretch_s = 0.15, settled_s = 0.25;
  constexpr std::size_t parts = 5, min_of_part = 4;
  std::vector<SteadyPoint> found;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Measurement& run = runs[r];
    if (!run.has_cart()) continue;
    const ForceTrace trace = force_trace(run, plant);
    const double period = run.median_period_s();
    const std::size_t length = std::max(static_cast<std::size_t>(stretch_s / period), parts * min_of_part);
    const auto settled = static_cast<std::size_t>(settled_s / period);
    std::size_t since = 0;
    for (std::size_t k = 1; k < run.size(); ++k) {
      if (run.voltage_v[k] != run.voltage_v[since]) since = k;
      if (run.voltage_v[since] == 0.0 || k - since < settled + length || (k - since - settled) % length != 0)
        continue;
      const PartSpeeds speeds = speeds_in_parts(run, k - length, length, parts);
      if (!is_steady(speeds)) continue;
      double v = 0.0, friction = 0.0;
      for (std::size_t j = k - length; j < k; ++j) {
        v += trace.cart_mps[j] / static_cast<double>(length);
        friction += trace.friction_n[j] / static_cast<double>(length);
      }
      found.push_back({r, v, friction});
    }
  }
  return found;
}

}  // namespace upright
