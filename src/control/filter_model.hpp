// The linear model of a plant near upright for the Kalman filter and its predictor, with unmodelled
// quantities as additional states.
#pragma once

#include <Eigen/Core>

#include "kalman_step.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

using FilterVector = Eigen::Matrix<double, filter_states, 1>;
using FilterMatrix = Eigen::Matrix<double, filter_states, filter_states>;

/// x' = a x + b u + constant while the cart slides (dry levels and bristles do not affect the slopes;
/// they are part of the force on the cart), u after the static actuator chain. The sensors show scale *
/// position + offset. Rows and columns of absent states are zero.
struct ContinuousModel {
  FilterMatrix a = FilterMatrix::Zero();
  FilterVector b = FilterVector::Zero(), constant = FilterVector::Zero();
  bool lags = false;  ///< the motor's voltage is a state
  double input_delay_s = 0.0;
  double actuator_slope = 1.0;                  ///< of the static chain, outside a dead zone
  double volts_per_newton = 0.0;                ///< after the static chain, at rest
  double known_force_n = 0.0;                   ///< the force that causes `constant`
  Eigen::Vector2d sensor_scale, sensor_offset;  ///< cart, pendulum
};

/// Throws ConfigError for a plant without a pendulum.
ContinuousModel continuous_model(const Plant& plant);

/// x(t + duration) = a x + b u + constant for constant u.
struct ModelStep {
  FilterMatrix a;
  FilterVector b, constant;
};
ModelStep step_over(const ContinuousModel& model, double duration_s);

/// Process noise of a filter, with all defaults filled in.
struct ProcessNoise {
  double cart_m2_per_s3 = 0.0, pendulum_rad2_per_s3 = 0.0;
  double cart_force_n2_per_s = 0.0, angle_zero_rad2_per_s = 0.0;
};
ProcessNoise process_noise_of(const StateEstimatorConfig& config, const Plant& plant);

/// Resolution of the encoders: that of the configuration, or a usual value where none is given.
struct Resolution {
  double cart_m, angle_rad;
};
Resolution resolution_of(const StateEstimatorConfig& config);

/// The stationary gain of the filter for (cart, pendulum) as true positions: x += gain (y - shown).
/// Throws ConfigError when there is none.
Eigen::Matrix<double, filter_states, 2> kalman_gain(const ContinuousModel& model, const ProcessNoise& noise,
                                                    const StateEstimatorConfig& config, double period_s);

/// Selects (cart position, pendulum angle plus its zero): the sensors' inputs before scale and offset.
Eigen::Matrix<double, 2, filter_states> shown_positions();

/// `config` with the resolution of the rig's encoders where the gain file has none.
ControlConfig with_encoders(ControlConfig config, double cart_resolution_m, double angle_resolution_rad);

}  // namespace upright
