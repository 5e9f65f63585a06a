#include "filter_model.hpp"

#include <Eigen/Core>
#include <numbers>
#include <vector>

#include "model/dense_algebra.hpp"
#include "model/linear_plant.hpp"
#include "model/riccati.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Where nothing says how fine the encoders are: those of the Quanser IP02.
constexpr double usual_cart_resolution_m = 2.27485e-5;
constexpr double usual_angle_resolution_rad = 2.0 * std::numbers::pi / 4096.0;

// What the model does not know, relative to the weight of the plant, so that the defaults serve a stage of 95
// kg as well as a cart of 0.8 kg.
/// Acceleration that comes and goes within `unmodelled_s`, as a share of gravity.
constexpr double unmodelled_acceleration = 0.035;
constexpr double unmodelled_s = 0.01;
/// The force on the cart may change by this share of the weight within `force_changes_s`: dry friction turns
/// round. Quicker follows friction better, and bears less delay of the actuator that the model lacks: this is
/// the largest that bore 5 ms of delay and 10 ms of lag on the paper's plants without a limit cycle.
constexpr double force_change = 0.11;
constexpr double force_changes_s = 0.01;
/// Where the plant file's friction is in the prediction, what it lacks changes by this share of that.
constexpr double of_force_change_with_friction = 0.6;
/// The angle's zero may be off by so much, and found within a few seconds.
constexpr double angle_zero_rad = 1e-3;
constexpr double angle_zero_s = 1.0;

double squared(double value) {
  return value * value;
}

std::vector<Index> states_present(const ContinuousModel& model, const ProcessNoise& noise) {
  std::vector<Index> present{filter_cart, filter_theta, filter_cart_velocity, filter_pendulum_rate};
  if (model.lags) present.push_back(filter_motor);
  if (noise.cart_force_n2_per_s > 0.0) present.push_back(filter_cart_force);
  if (noise.angle_zero_rad2_per_s > 0.0) present.push_back(filter_angle_zero);
  return present;
}

/// Covariance that white noise of density `w` adds over a period (Van Loan 1978).
MatrixXd sampled_noise(const MatrixXd& a, const MatrixXd& w, double period_s) {
  const Index n = a.rows();
  MatrixXd block = MatrixXd::Zero(2 * n, 2 * n);
  block.topLeftCorner(n, n) = -a;
  block.topRightCorner(n, n) = w;
  block.bottomRightCorner(n, n) = a.transpose();
  const MatrixXd step = hold_input(block, MatrixXd::Zero(2 * n, 0), period_s).a;
  const MatrixXd covariance = step.bottomRightCorner(n, n).transpose() * step.topRightCorner(n, n);
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace

ContinuousModel continuous_model(const Plant& plant) {
  if (!plant.pendulum)
    throw ConfigError(
        "the estimator's plant has no pendulum: name a plant file with a pendulum in state_estimator");
  constexpr double any_smoothing = 1.0;  // no dry level is left to smooth
  const LinearPlant linear = linearize(sliding_plant(without_vibrations(plant)), any_smoothing);
  const Index n = linear.a.rows();
  ContinuousModel model;
  model.a.topLeftCorner(n, n) = linear.a;
  model.b.head(n) = linear.b;
  model.constant.head(n) = linear.constant;
  model.lags = n > filter_motor;
  model.input_delay_s = linear.input_delay_s;
  model.actuator_slope = linear.actuator_slope;
  model.sensor_scale = linear.sensor_scale.head<2>();
  model.sensor_offset = linear.sensor_offset.head<2>();
  const Eigen::VectorXd per_volt = model.lags ? Eigen::VectorXd(linear.a.col(filter_motor)) : linear.b;
  model.volts_per_newton = 1.0 / plant.motor.force_per_volt_n;
  model.a.col(filter_cart_force).segment<2>(filter_cart_velocity) =
      per_volt.segment<2>(filter_cart_velocity) * model.volts_per_newton;
  model.known_force_n =
      linear.constant(filter_cart_velocity) / model.a(filter_cart_velocity, filter_cart_force);
  return model;
}

ModelStep step_over(const ContinuousModel& model, double duration_s) {
  Eigen::Matrix<double, filter_states, 2> inputs;
  inputs << model.b, model.constant;
  const SampledPlant sampled = hold_input(model.a, inputs, duration_s);
  return {sampled.a, sampled.b.col(0), sampled.b.col(1)};
}

ProcessNoise process_noise_of(const StateEstimatorConfig& config, const Plant& plant) {
  const double weight_n = (plant.cart_mass_kg + plant.pendulum->mass_kg) * plant.gravity_mps2;
  const double fall_radps2 = plant.pendulum->mass_kg * plant.pendulum->length_to_com_m * plant.gravity_mps2 /
                             plant.pendulum->inertia_about_pivot_kgm2();
  const double part = squared(unmodelled_acceleration) * unmodelled_s;
  const bool knows_friction = config.kind == StateEstimatorKind::extended_kalman;
  const double change = force_change * (knows_friction ? of_force_change_with_friction : 1.0);
  return {config.cart_noise_m2_per_s3.value_or(part * squared(plant.gravity_mps2)),
          config.pendulum_noise_rad2_per_s3.value_or(part * squared(fall_radps2)),
          config.cart_force_noise_n2_per_s.value_or(squared(change * weight_n) / force_changes_s),
          config.angle_zero_noise_rad2_per_s.value_or(squared(angle_zero_rad) / angle_zero_s)};
}

Eigen::Matrix<double, 2, filter_states> shown_positions() {
  Eigen::Matrix<double, 2, filter_states> shows = Eigen::Matrix<double, 2, filter_states>::Zero();
  shows(0, filter_cart) = 1.0;
  shows(1, filter_theta) = 1.0;
  shows(1, filter_angle_zero) = 1.0;
  return shows;
}

Resolution resolution_of(const StateEstimatorConfig& config) {
  return {config.cart_resolution_m.value_or(usual_cart_resolution_m),
          config.angle_resolution_rad.value_or(usual_angle_resolution_rad)};
}

Eigen::Matrix<double, filter_states, 2> kalman_gain(const ContinuousModel& model, const ProcessNoise& noise,
                                                    const StateEstimatorConfig& config, double period_s) {
  FilterVector density = FilterVector::Zero();
  density(filter_cart_velocity) = noise.cart_m2_per_s3;
  density(filter_pendulum_rate) = noise.pendulum_rad2_per_s3;
  density(filter_cart_force) = noise.cart_force_n2_per_s;
  density(filter_angle_zero) = noise.angle_zero_rad2_per_s;
  const Resolution resolution = resolution_of(config);
  const Eigen::Vector2d step(resolution.cart_m / model.sensor_scale(0),
                             resolution.angle_rad / model.sensor_scale(1));
  const std::vector<Index> at = states_present(model, noise);
  const MatrixXd a = model.a(at, at), w = MatrixXd(density.asDiagonal())(at, at);
  // In units of the encoders' steps, so that the equation's terms are of like size.
  const MatrixXd shows = step.cwiseInverse().asDiagonal() * shown_positions()(Eigen::all, at);
  const MatrixXd sampled = hold_input(a, MatrixXd::Zero(a.rows(), 0), period_s).a;
  constexpr double rounding_counts2 = 1.0 / 12.0;
  const MatrixXd rounding =
      Eigen::Vector2d(rounding_counts2, config.angle_noise_counts2.value_or(rounding_counts2)).asDiagonal();
  const DiscreteRiccatiSolution solution =
      solve_discrete_riccati(sampled.transpose(), shows.transpose(), sampled_noise(a, w, period_s),
                             MatrixXd::Zero(a.rows(), 2), rounding);
  const MatrixXd spread = shows * solution.x * shows.transpose() + rounding;
  const MatrixXd gain = solve_symmetric(spread, shows * solution.x).transpose();
  Eigen::Matrix<double, filter_states, 2> whole = Eigen::Matrix<double, filter_states, 2>::Zero();
  whole(at, Eigen::all) = gain * step.cwiseInverse().asDiagonal();
  if (!whole.allFinite())
    throw ConfigError("the estimator's gain is not finite: correct the process noise in state_estimator");
  return whole;
}

ControlConfig with_encoders(ControlConfig config, double cart_resolution_m, double angle_resolution_rad) {
  StateEstimatorConfig& estimator = config.state_estimator;
  if (!config.has_state_estimator()) return config;
  if (!estimator.cart_resolution_m) estimator.cart_resolution_m = cart_resolution_m;
  if (!estimator.angle_resolution_rad) estimator.angle_resolution_rad = angle_resolution_rad;
  return config;
}

}  // namespace upright
