// A plant linearised near upright: x' = A x + b u + f, with derivatives of the nonlinear equations by
// dual numbers. Used for gain design, delay margins and the prediction of delayed states.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "upright/model/plant.hpp"

namespace upright {

/// The number of states that the gains of a gain file multiply, in their order.
constexpr std::size_t fed_back_count = 4;
/// Their names.
constexpr std::array<std::string_view, fed_back_count> fed_back_names = {
    "cart_m", "theta_rad", "cart_velocity_mps", "pendulum_rate_radps"};

/// n states in SI units: cart_m, theta_rad, cart_velocity_mps, pendulum_rate_radps (without a pendulum
/// the two of the cart only), then bristle_m, attached_m and attached_mps, and motor_v where the plant has
/// them. The sensors show scale * state + offset of the fed-back states.
struct LinearPlant {
  std::vector<std::string> states;    ///< names, n
  std::vector<std::size_t> fed_back;  ///< for each of the first states its index among `fed_back_names`
  Eigen::MatrixXd a;                  ///< n x n
  Eigen::VectorXd b;                  ///< n, per volt after the static actuator chain
  Eigen::VectorXd constant;           ///< n, the rate at the origin with zero volts after the static chain
  double actuator_slope = 1.0;     ///< volts after the static chain per volt commanded, outside a dead zone
  double input_delay_s = 0.0;      ///< delay of the plant's input [s]
  Eigen::VectorXd sensor_scale;    ///< one for each fed-back state of the plant
  Eigen::VectorXd sensor_offset;   ///< one for each fed-back state of the plant
  std::vector<std::string> notes;  ///< what the linearisation neglects, one sentence each
};

/// Linearises a plant at rest upright, at the cart's origin. sgn(v) of rigid dry friction is replaced by
/// tanh(smoothing v), smoothing > 0 in s/m (s/rad at the pivot); other kinks by the mean of their two
/// slopes. Throws ConfigError, with name and entries of the matrix, when an entry is not finite.
LinearPlant linearize(const Plant& plant, double smoothing);

/// The plant while it slides in one direction. Dry levels do not affect the slopes, so they and their
/// bristles are removed. Valid for motions far larger than the stick-slip band.
Plant sliding_plant(const Plant& plant);

/// The plant with its sprung mass bolted to the cart and with a rigid rod, as slow motions see it: for
/// feedback and observers, whose gains and states are those of the rigid bodies.
Plant without_vibrations(Plant plant);

/// x(t + duration) = a x(t) + b u for an input that is constant over the duration; exact.
struct SampledPlant {
  Eigen::MatrixXd a;  ///< transition over the duration, n x n
  Eigen::MatrixXd b;  ///< one column per input
};
/// Throws ConfigError where an entry is not finite.
SampledPlant hold_input(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double duration_s);

/// A matrix as errors show it: "A = [1 2; 3 4]".
std::string matrix_text(std::string_view name, const Eigen::MatrixXd& matrix);

}  // namespace upright
