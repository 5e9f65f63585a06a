// Gain design: linear-quadratic state feedback for a plant, continuous or for the sampled loop.
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "controllable_part.hpp"
#include "model/linear_plant.hpp"
#include "upright/control/velocity_estimator.hpp"
#include "upright/model/plant.hpp"

namespace upright {

struct DesignWeights {
  std::array<double, 4> q{5000.0, 3000.0, 20.0, 20.0};  ///< on x, theta, x_dot, theta_dot; >= 0
  double r = 1.0;                                       ///< on the commanded voltage; > 0
};

struct GainDesign {
  /// V = gains . [x, theta, x_dot, theta_dot], measured; V/m, V/rad, V s/m, V s/rad. Zero where the plant has
  /// no pendulum.
  std::array<double, 4> gains{};
  /// Continuous design: of the plant with the gains, motor lag included [1/s]. Sampled: log(z)/T of every
  /// root z other than the delay line's roots at zero.
  std::vector<std::complex<double>> closed_loop_poles;
  double residual = 0.0;  ///< of the Riccati equation, relative
  std::vector<EliminatedState> eliminated;
  std::vector<std::string> notes;
};

/// Minimises the integral of x'Qx + rV^2 on the linearised plant. Throws ConfigError.
GainDesign design_gains(const Plant& plant, const DesignWeights& weights, double smoothing);

struct SampledDesign {
  GainDesign design;  ///< gains on the state at the time the voltage acts, as the predictor gives it
  int delay_periods = 0;
  double prediction_s = 0.0;  ///< how far the predictor looks ahead: loop delay and the plant's input delay
  double delay_line_residual =
      0.0;  ///< of the Riccati equation with delay line and velocity filter as states
  double delay_line_difference = 0.0;  ///< gains from that equation against `design.gains`, relative
};

/// The same cost for a loop that samples at `rate_hz`, holds its voltage, and acts `delay_s` late: a discrete
/// equation with every voltage on its way and the velocity estimator as states. Its optimum feeds back the
/// predicted state and leaves the estimator alone (so the gains do not depend on the delay, and the poles are
/// those without it); it needs `delay_compensation: {kind: predictor}`. Throws ConfigError.
SampledDesign design_sampled_gains(const Plant& plant, const DesignWeights& weights, double smoothing,
                                   double rate_hz, double delay_s, const EstimatorConfig& estimator = {});

/// What a sampled loop costs whose gains are not the optimal ones: of the same integral, with the true state
/// and without delay.
class GainCost {
 public:
  /// Throws ConfigError as the design does.
  GainCost(const Plant& plant, const DesignWeights& weights, double smoothing, double rate_hz);

  /// By how much the cost exceeds the smallest one, relative, from the start for which it exceeds it most;
  /// infinite for gains that do not stabilise the plant.
  double loss(const std::array<double, 4>& gains) const;
  /// As in GainDesign, for these gains.
  std::vector<std::complex<double>> closed_loop_poles(const std::array<double, 4>& gains) const;

 private:
  Eigen::RowVectorXd feedback(const std::array<double, 4>& gains) const;

  LinearPlant plant_;
  Eigen::MatrixXd a_, q_;
  Eigen::VectorXd b_, s_;
  double r_ = 0.0, rate_hz_;
  Eigen::MatrixXd smallest_;  ///< the smallest cost from a state x is x' smallest_ x
};

}  // namespace upright
