// A plant near upright as x' = A x + b u + f: derivatives of the one physics by dual numbers, no matrix by
// hand. Serves gain design, margins and the prediction of delayed states.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "upright/model/plant.hpp"

namespace upright {

/// What the gains of a gain file multiply, in their order.
constexpr std::size_t fed_back_count = 4;
constexpr std::array<std::string_view, fed_back_count> fed_back_names = {
    "cart_m", "theta_rad", "cart_velocity_mps", "pendulum_rate_radps"};

/// n states in SI units: cart_m, theta_rad, cart_velocity_mps, pendulum_rate_radps (without a pendulum the
/// cart's two alone), then bristle_m and motor_v where the plant has them. The sensors show scale * state +
/// offset of the fed-back ones.
struct LinearPlant {
  std::vector<std::string> states;    ///< names, n
  std::vector<std::size_t> fed_back;  ///< for each of the first states its place among `fed_back_names`
  Eigen::MatrixXd a;                  ///< n x n
  Eigen::VectorXd b;                  ///< n, per volt behind the static actuator chain
  Eigen::VectorXd constant;           ///< n, the rate at the origin with zero volts behind the chain
  double actuator_slope = 1.0;        ///< volts behind the static chain per volt commanded, off a dead zone
  double input_delay_s = 0.0;
  Eigen::VectorXd sensor_scale;  ///< one for each fed-back state the plant has
  Eigen::VectorXd sensor_offset;
  std::vector<std::string> notes;  ///< what the line does not show, a sentence each
};

/// Linearises a plant at rest upright, at the cart's origin. sgn(v) of rigid dry friction is taken as
/// tanh(smoothing v), smoothing in s/m (s/rad at the pivot), > 0; other kinks count with the mean of their
/// two slopes. Throws ConfigError, naming and printing the matrix, when an entry is not finite.
LinearPlant linearize(const Plant& plant, double smoothing);

/// The plant as it is while it slides one way: dry levels do not change the slopes, so they and the bristles
/// that render them are taken out. What motions far larger than the stick-slip band feel.
Plant sliding_plant(const Plant& plant);

/// x(t + duration) = a x(t) + b u for an input held over the duration; exact.
struct SampledPlant {
  Eigen::MatrixXd a;
  Eigen::MatrixXd b;  ///< one column per input
};
SampledPlant hold_input(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double duration_s);

/// "A = [1 2; 3 4]": a matrix as an error shows it.
std::string matrix_text(std::string_view name, const Eigen::MatrixXd& matrix);

}  // namespace upright
