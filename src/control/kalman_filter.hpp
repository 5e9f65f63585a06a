// A stationary Kalman filter for a plant near upright, discretised with zero-order hold.
//
// The model is the plant file's while the cart slides; dry friction is part of the estimated force. The
// actuator chain is exact: dead zone, gain, offset and saturation act on the command, the input delay is
// a buffer, the lag a state. Measurement noise is that of quantisation, q^2/12.
//
// Far from upright, outside the linear range, the states follow the sensors and the velocity filter.
#pragma once

#include <cstdint>
#include <vector>

#include "filter_model.hpp"
#include "kalman_step.hpp"
#include "upright/control/state_estimator.hpp"
#include "upright/control/velocity_estimator.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

class KalmanFilter : public StateEstimator {
 public:
  /// Throws ConfigError when there is no stationary filter for this plant.
  KalmanFilter(const ControlConfig& config, const Plant& plant);

  void start(double cart_m, double theta_rad) noexcept override;
  ControlState update(double cart_m, double theta_rad, double applied_v) noexcept final;
  ControlState predict(double applied_v) noexcept final;
  double rejecting_v(const ControlState& estimate) const noexcept override;
  double command_v(double wanted_v) const noexcept override;

  /// One step, for analysis, per volt commanded and per unit of the sensors: x(k + 1) = keeps (a x(k) +
  /// late u(k - d) + early u(k - d - 1)) + gain y(k + 1).
  struct Linear {
    FilterMatrix a, keeps;
    FilterVector late, early;
    Eigen::Matrix<double, filter_states, 2> gain;
    std::vector<Eigen::Index> present;                 ///< the states that are not always zero
    std::size_t input_periods;                         ///< d
    Eigen::Matrix<double, 4, filter_states> fed_back;  ///< in sensor units
    double rejecting_v_per_n;
  };
  Linear linear() const;
  /// One step, to simulate many filters side by side, and the model of whose static actuator chain.
  const KalmanStep& step() const { return step_; }
  const PlantModel<double>& model() const { return model_; }

 protected:
  /// Moves `state_` on by a period under the voltages behind the static chain: `late_v` acts at its end,
  /// `early_v` before that for the fraction of a period that the input delay has.
  virtual void propagate(double late_v, double early_v) noexcept;
  /// How far the sensor shows the cart from where `state_` has it, beyond scale and offset [m].
  virtual double encoder_ahead_m() const noexcept { return 0.0; }
  /// The force on the cart that the voltage takes away, beyond what is known and constant [N].
  virtual double rejected_force_n() const noexcept { return step_.share * state_(filter_cart_force); }

  /// Of a period, by which the input delay exceeds whole ones.
  double input_fraction() const { return input_fraction_; }
  double resting_v() const { return actuator_.actuate(0.0); }
  /// Of what the sensor shows: the position of the cart.
  double position_of(double cart_m) const { return step_.position_of(0, cart_m); }
  bool lags() const { return step_.late[filter_motor] != 0.0; }

  FilterVector state_ = FilterVector::Zero();

 private:
  void advance(double applied_v) noexcept;
  void update_velocities(double cart_m, double theta_rad) noexcept;
  ControlState shown() const noexcept;

  PlantModel<double> model_;
  Dynamics<double> actuator_;
  KalmanStep step_;
  double input_fraction_ = 0.0;
  double slope_ = 1.0;
  VelocityEstimator cart_, pendulum_;
  std::uint32_t missed_ = 0;    ///< periods since the last reading
  std::vector<double> drives_;  ///< voltages behind the static chain, a ring; newest at `newest_`
  std::size_t newest_ = 0;
  double turn_rad_ = 0.0;  ///< the upright pose that the angle is from
};

}  // namespace upright
