// The initial states of segments: a guess from the data alone, and their fit with plant and noise held.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include "base/parallel.hpp"
#include "fit.hpp"
#include "model/dense_algebra.hpp"

namespace upright {

namespace {

/// Least squares of a parabola over samples around k: value and slope there.
std::pair<double, double> local_fit(const std::vector<double>& t, const std::vector<double>& y, std::size_t k,
                                    const Segment& within, double width_s) {
  std::size_t a = k, b = k;
  while (a > within.first && t[k] - t[a - 1] <= width_s) --a;
  while (b < within.last && t[b + 1] - t[k] <= width_s) ++b;
  while (b - a < 4 && (a > within.first || b < within.last)) {
    if (a > within.first) --a;
    if (b < within.last) ++b;
  }
  Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  bool constant = true;
  for (std::size_t i = a; i <= b; ++i) {
    const double u = (t[i] - t[k]) / width_s;
    const Eigen::Vector3d basis(1.0, u, u * u);
    h += basis * basis.transpose();
    g += basis * (y[i] - y[k]);
    constant = constant && y[i] == y[k];
  }
  if (constant) return {y[k], 0.0};
  const Eigen::VectorXd fitted = solve_symmetric(h + 1e-12 * Eigen::Matrix3d::Identity(), g);
  return {y[k] + fitted[0], fitted[1] / width_s};
}

/// The state of which the sensors show these values.
void state_from_outputs(const Dynamics<double>& dynamics, PlantState<double>& state) {
  const SensorLine<double> line(dynamics.model());
  state.cart_mps /= line.cart_gain;
  state.theta_radps /= line.theta_gain;
  PlantState<double> at_origin = state;
  at_origin.cart_m = at_origin.theta_rad = 0.0;
  const Outputs<double> shown = dynamics.measure(at_origin);
  const double turned_m = (state.cart_m - shown.cart_m) / line.cart_gain;
  const double ahead_m = shown.cart_m / line.cart_gain;  // of the cart is a drive that gives way
  state.cart_m =
      drive_position_m(dynamics.model(), turned_m + ahead_m) - drive_position_m(dynamics.model(), ahead_m);
  state.theta_rad = (state.theta_rad - shown.theta_rad) / line.theta_gain;
}

PlantState<double> estimate_initial_state(const Measurement& run, const Segment& segment, const Plant& plant,
                                          const Dynamics<double>& dynamics) {
  constexpr double width_s = 0.03;
  PlantState<double> s;
  // Unmeasured angle: hanging at rest.
  s.theta_rad = plant.pendulum ? std::numbers::pi : 0.0;
  if (run.has_cart())
    std::tie(s.cart_m, s.cart_mps) = local_fit(run.time_s, run.cart_m, segment.first, segment, width_s);
  if (run.has_theta() && plant.pendulum)
    std::tie(s.theta_rad, s.theta_radps) =
        local_fit(run.time_s, run.theta_rad, segment.first, segment, width_s);
  state_from_outputs(dynamics, s);
  if (dynamics.has_bristle_state() && s.cart_mps != 0.0) {
    const double direction = s.cart_mps > 0.0 ? 1.0 : -1.0;
    s.bristle_m = direction * dynamics.cart_dry_level(s.cart_m, std::abs(s.cart_mps), direction) /
                  dynamics.bristle_stiffness();
  }
  return s;
}

/// Where the initial state of one segment goes from several of the same, with noise that carries it over from
/// one basin to the next: a plain simulation past friction or a cogged track has many.
FitResult fit_initial_state_through_noise(const FitData& segment, FitPoint point, const FitOptions& options) {
  const Noise wanted = point.noise;
  double work_samples = 0.0;
  for (const double share : {1.0, 0.1, 0.01, 1e-3}) {
    point.noise.force = std::max(wanted.force, 0.1 * share);
    point.noise.torque = std::max(wanted.torque, 0.01 * share);
    const FitResult carried = fit(segment, point, {}, options);
    work_samples += carried.work_samples;
    if (std::isfinite(carried.objective)) point.starts = carried.point.starts;
  }
  point.noise = wanted;
  FitResult found = fit(segment, point, {}, options);
  found.work_samples += work_samples;
  return found;
}

FitResult fit_initial_state(const FitData& segment, const FitPoint& point, const FitOptions& options) {
  FitResult found = fit(segment, point, {}, options);
  constexpr double suspicious = 1.3;  // so far off, in noise standard deviations, that it may be elsewhere
  if (whitened_rms(found) < suspicious) return found;
  FitResult other = fit_initial_state_through_noise(segment, point, options);
  const double work_samples = found.work_samples + other.work_samples;
  FitResult& better = other.objective < found.objective ? other : found;
  better.work_samples = work_samples;
  return better;
}

}  // namespace

void convert_initial_states(std::vector<PlantState<double>>& starts, const Plant& from, const Plant& to) {
  const PlantModel<double> model_from = make_model<double>(from), model_to = make_model<double>(to);
  const Dynamics<double> before(model_from), after(model_to);
  const SensorLine<double> line(model_from);
  for (PlantState<double>& state : starts) {
    const Outputs<double> shown = before.measure(state);
    state.cart_m = shown.cart_m;
    state.theta_rad = shown.theta_rad;
    state.cart_mps *= line.cart_gain;
    state.theta_radps *= line.theta_gain;
    state_from_outputs(after, state);
  }
}

std::vector<PlantState<double>> estimate_initial_states(const std::vector<Measurement>& runs,
                                                        const std::vector<Segment>& segments,
                                                        const Plant& plant) {
  const PlantModel<double> model = make_model<double>(plant);
  const Dynamics<double> dynamics(model);
  std::vector<PlantState<double>> starts;
  starts.reserve(segments.size());
  for (const Segment& segment : segments)
    starts.push_back(estimate_initial_state(runs[segment.run], segment, plant, dynamics));
  return starts;
}

FitResult fit_initial_states(const FitData& data, const FitPoint& start, int max_iterations) {
  const FitOptions options = steps_with_fixed_noise(max_iterations);
  if (data.bound != nullptr) data.bound->check();
  std::vector<FitResult> found(data.segments.size());
  parallel_for(found.size(), [&](std::size_t s) {
    found[s] = fit_initial_state({data.runs, {data.segments[s]}},
                                 {start.plant, {start.starts[s]}, start.noise}, options);
  });
  FitResult result;
  result.point = start;
  result.converged = true;
  for (std::size_t s = 0; s < found.size(); ++s) {
    const FitResult& one = found[s];
    result.point.starts[s] = one.point.starts[0];
    result.objective += one.objective;
    result.work_samples += one.work_samples;
    result.converged = result.converged && one.converged;
    result.segment_objective.push_back(one.segment_objective[0]);
    result.segment_chi_square.push_back(one.segment_chi_square[0]);
    result.segment_samples.push_back(one.segment_samples[0]);
    result.block_objective.insert(result.block_objective.end(), one.block_objective.begin(),
                                  one.block_objective.end());
  }
  if (data.bound != nullptr) data.bound->count(result.work_samples);
  return result;
}

FitPoint with_fitted_initial_states(const FitData& data, FitPoint point) {
  const FitResult fitted = fit_initial_states(data, point, 6);
  if (std::isfinite(fitted.objective)) point.starts = fitted.point.starts;
  return point;
}

}  // namespace upright
