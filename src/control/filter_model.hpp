// A plant as the Kalman filter and its predictor see it: linear about upright, with what the plant file does
// not know as further states.
#pragma once

#include <Eigen/Core>

#include "upright/control/gain_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// Where a state stands.
enum FilterState : Eigen::Index {
  filter_cart,           ///< [m]
  filter_theta,          ///< [rad] from upright
  filter_cart_velocity,  ///< [m/s]
  filter_pendulum_rate,  ///< [rad/s]
  filter_motor,          ///< [V] behind a motor lag; without one it stays zero
  filter_cart_force,     ///< [N] on the cart, beyond the model
  filter_angle_zero,     ///< [rad] that the sensor shows upright, beyond the model
  filter_states
};

using FilterVector = Eigen::Matrix<double, filter_states, 1>;
using FilterMatrix = Eigen::Matrix<double, filter_states, filter_states>;

/// x' = a x + b u + constant while the cart slides (dry levels and bristles taken out: they change no slope
/// and are part of the force on the cart), u behind the static actuator chain. The sensors show scale * (x of
/// the position) + offset. Rows and columns of absent states are zero.
struct ContinuousModel {
  FilterMatrix a = FilterMatrix::Zero();
  FilterVector b = FilterVector::Zero(), constant = FilterVector::Zero();
  bool lags = false;  ///< the motor's voltage is a state
  double input_delay_s = 0.0;
  double actuator_slope = 1.0;                  ///< of the static chain, off a dead zone
  double volts_per_newton = 0.0;                ///< behind the static chain, at rest
  double known_force_n = 0.0;                   ///< that `constant` comes from
  Eigen::Vector2d sensor_scale, sensor_offset;  ///< cart, pendulum
};

/// Throws ConfigError for a plant without a pendulum.
ContinuousModel continuous_model(const Plant& plant);

/// x(t + duration) = a x + b u + constant with u held.
struct ModelStep {
  FilterMatrix a;
  FilterVector b, constant;
};
ModelStep step_over(const ContinuousModel& model, double duration_s);

/// Process noise of a filter with every default filled in.
struct ProcessNoise {
  double cart_m2_per_s3 = 0.0, pendulum_rad2_per_s3 = 0.0;
  double cart_force_n2_per_s = 0.0, angle_zero_rad2_per_s = 0.0;
};
ProcessNoise process_noise_of(const StateEstimatorConfig& config, const Plant& plant);

/// Steps of the encoders: those of the configuration, or what is usual where nothing says.
struct Resolution {
  double cart_m, angle_rad;
};
Resolution resolution_of(const StateEstimatorConfig& config);

/// The stationary filter's gain on (cart, pendulum) as true positions: x += gain (y - shown). Throws
/// ConfigError when there is none.
Eigen::Matrix<double, filter_states, 2> kalman_gain(const ContinuousModel& model, const ProcessNoise& noise,
                                                    const StateEstimatorConfig& config, double period_s);

/// (x of the cart, x of the pendulum and its zero): what the sensors show before scale and offset.
Eigen::Matrix<double, 2, filter_states> shown_positions();

/// `config` with the steps of the rig's encoders where the gain file does not name them.
ControlConfig with_encoders(ControlConfig config, double cart_resolution_m, double angle_resolution_rad);

}  // namespace upright
