// Gain files (docs/reference/files.md): read strictly; written files read back exactly.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "upright/base/yaml_reader.hpp"
#include "upright/control/velocity_estimator.hpp"

namespace upright {

/// V = cart_position x + pendulum_angle theta + cart_velocity x' + pendulum_rate theta'.
struct Gains {
  double cart_position_v_per_m = 0.0;      ///< of the cart's position [V/m]
  double pendulum_angle_v_per_rad = 0.0;   ///< of the pendulum's angle [V/rad]
  double cart_velocity_v_per_mps = 0.0;    ///< of the cart's velocity [V s/m]
  double pendulum_rate_v_per_radps = 0.0;  ///< of the pendulum's rate [V s/rad]
};

/// How the delay is compensated: not at all, or by a model that predicts.
enum class CompensationKind : std::uint8_t { none, predictor };

/// Compensation of the configured delay.
struct DelayCompensation {
  CompensationKind kind = CompensationKind::none;  ///< how the delay is compensated
  std::filesystem::path
      plant;  ///< predictor only: the plant file of its model, resolved against the gain file
};

/// Which model-based estimator is used.
enum class StateEstimatorKind : std::uint8_t {
  none,
  kalman,           ///< predicts with the plant file while the cart slides; friction is an unknown force
  extended_kalman,  ///< predicts with the complete plant file, including dry friction and all effects
};

/// A Kalman filter in place of the velocity estimator. Values that are absent have defaults that follow
/// from the plant (`process_noise_of`) or from the rig's encoders (`with_encoders`).
struct StateEstimatorConfig {
  StateEstimatorKind kind = StateEstimatorKind::none;  ///< which estimator; none: the velocity estimator
  std::filesystem::path plant;  ///< plant file of the model, resolved against the gain file
  /// Intensity of the random walk that models the unknown force on the cart: the main tuning parameter. A
  /// larger value follows friction faster, and tolerates less unmodelled delay of the actuator. 0: no
  /// such force.
  std::optional<double> cart_force_noise_n2_per_s;
  /// Intensity of the random walk of the angle's zero; 0: the zero is as calibrated.
  std::optional<double> angle_zero_noise_rad2_per_s;
  std::optional<double> cart_noise_m2_per_s3;        ///< white acceleration noise of the cart
  std::optional<double> pendulum_noise_rad2_per_s3;  ///< white acceleration noise of the pendulum
  std::optional<double> cart_resolution_m;           ///< resolution of the cart's encoder
  std::optional<double> angle_resolution_rad;        ///< resolution of the pendulum's encoder
  /// Variance of the angle's reading in squared counts; absent: 1/12, that of a rounding that changes with
  /// every reading. Near rest the angle stays within a count for many readings, whose errors then add up.
  std::optional<double> angle_noise_counts2;
};

/// Share of the estimated disturbance force on the cart that the voltage cancels, 0 to 1.
struct DisturbanceRejection {
  double share = 1.0;  ///< share of the estimated force that is cancelled, 0 to 1
  /// Time constant with which a predictor lets the force decay; 0: it stays constant.
  double decay_s = 0.0;
};

/// Share of the dry friction in an extended Kalman filter's plant file that the voltage cancels, 0 to 1.
struct FrictionCompensation {
  double share = 1.0;  ///< share of the modelled friction that is cancelled, 0 to 1
  /// Time constant of a first-order lag of the compensation [s]: about the delay of a real actuator
  /// beyond its model. A shorter lag would act before the motor has reversed its force.
  double lag_s = 0.005;
};

/// The configuration of a controller: V(t) = gains . [x, theta, x', theta'](t - delay_s).
struct ControlConfig {
  Gains gains;                           ///< of the state feedback
  double delay_s = 0.0;                  ///< delay of the feedback [s]
  double sample_rate_hz = 1000.0;        ///< rate of the loop [Hz]
  EstimatorConfig estimator;             ///< of velocities from positions
  StateEstimatorConfig state_estimator;  ///< of the state by a model
  DisturbanceRejection rejection;        ///< of the estimated force on the cart
  FrictionCompensation friction;         ///< of the friction in the plant file
  DelayCompensation compensation;        ///< of the delay

  double period_s() const { return 1.0 / sample_rate_hz; }  ///< period of the loop [s]
  /// Whether a model estimates the state.
  bool has_state_estimator() const { return state_estimator.kind != StateEstimatorKind::none; }
};

inline constexpr double lowest_sample_rate_hz = 1.0;       ///< the lowest rate of a loop [Hz]
inline constexpr double highest_sample_rate_hz = 20000.0;  ///< the highest rate of a loop [Hz]

/// Reads a gain file. Throws ConfigError with remedy, file, line and key.
ControlConfig read_gain_file(const std::filesystem::path& file);

/// Reads the same keys from a parsed map, and refuses all other keys in it.
ControlConfig read_gains(const YamlMap& document);

/// The gain file as text, with `comments` as lines at its top.
std::string gain_text(const ControlConfig& config, const std::vector<std::string>& comments = {});

/// Writes the gain file and replaces an existing one. Throws Error when it cannot be written.
void write_gain_file(const ControlConfig& config, const std::filesystem::path& file,
                     const std::vector<std::string>& comments = {});

}  // namespace upright
