// The sampled loop as it runs, linearised: plant with held voltage, input delay and motor lag, velocity
// estimator, delay line with its interpolation, state feedback, and the predictor where the gain file has
// one.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <vector>

#include "upright/control/gain_file.hpp"
#include "upright/control/predictor.hpp"
#include "upright/model/plant.hpp"

namespace upright {

class LinearSampledLoop {
 public:
  /// Linearises `plant` with sgn(v) as tanh(smoothing v). Reads the predictor's plant where there is one.
  /// Throws ConfigError.
  LinearSampledLoop(const Plant& plant, const ControlConfig& config, double smoothing);

  double period_s() const { return period_s_; }
  /// The part of the loop's delay that `delay_s` below comes on top of: the predictor's own, or none.
  double compensated_delay_s() const { return compensated_delay_s_; }

  /// V = transfer(z) * line(z, delay) * V is the loop's characteristic equation; transfer has no delay line
  /// in it (with a predictor: the compensated one).
  std::complex<double> transfer(std::complex<double> z) const;
  /// z^-d ((1 - f) + f / z) for a delay of d + f periods, as the delay line gives it.
  std::complex<double> line(std::complex<double> z, double delay_s) const;

  /// All states of the closed loop over one period; roots inside the unit circle mean stability.
  Eigen::MatrixXd closed_loop(double delay_s) const;
  /// log(z) / T of the root z of largest magnitude [1/s].
  std::complex<double> rightmost_root(double delay_s) const;

 private:
  std::complex<double> predicted_voltages(std::complex<double> z) const;
  std::vector<double> taps(double delay_s) const;

  double period_s_;
  double compensated_delay_s_ = 0.0;
  Eigen::MatrixXd a_;  ///< plant, the last voltage (for a fractional input delay), estimators
  Eigen::VectorXd b_;
  Eigen::Matrix4Xd shows_;    ///< x, theta and the estimated velocities from the states
  Eigen::RowVector4d gains_;  ///< on what is fed back
  int input_periods_ = 0;     ///< whole periods of the plant's input delay
  std::optional<Predictor::Linear> predictor_;
};

}  // namespace upright
