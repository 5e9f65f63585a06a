// The sampled loop as it runs, linearised: plant with held voltage, input delay and motor lag, velocity or
// state estimator, delay line with its interpolation, state feedback, and the predictor where the gain file
// has one.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

#include "upright/control/gain_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// Where a delay comes on top of what the gain file says.
enum class ExtraDelay : std::uint8_t {
  known,       ///< in the delay line: `delay_s`, which a state estimator knows of
  unmodelled,  ///< in the actuator: later than the estimator and the predictor believe
};

class LinearSampledLoop {
 public:
  /// Linearises `plant` with sgn(v) as tanh(smoothing v). Reads the estimator's and the predictor's plants
  /// where there are some. Throws ConfigError.
  LinearSampledLoop(const Plant& plant, const ControlConfig& config, double smoothing,
                    ExtraDelay extra = ExtraDelay::known);

  double period_s() const { return period_s_; }
  /// The part of the loop's delay that `delay_s` below comes on top of. Known: the predictor's own, or none;
  /// unmodelled: the gain file's.
  double base_delay_s() const { return base_delay_s_; }

  /// V = transfer(z) * line(z, delay) * V is the loop's characteristic equation; transfer has none of the
  /// delay on top in it.
  std::complex<double> transfer(std::complex<double> z) const;
  /// z^-d ((1 - f) + f / z) for a delay of d + f periods, as the delay line gives it.
  std::complex<double> line(std::complex<double> z, double delay_s) const;

  /// Periods of delay, prediction and input delay that a closed loop may remember for its roots to be found:
  /// some 5 s of computing.
  static constexpr double most_periods = 1200.0;
  /// Whether it remembers no more.
  bool has_roots(double delay_s) const;
  /// All states of the closed loop over one period; roots inside the unit circle mean stability. Throws
  /// ConfigError for a loop that remembers too much.
  Eigen::MatrixXd closed_loop(double delay_s) const;
  /// log(z) / T of the root z of largest magnitude [1/s]. Throws as closed_loop.
  std::complex<double> rightmost_root(double delay_s) const;

 private:
  /// What is fed back from what the estimator shows and from the voltages on their way, per volt.
  struct Prediction {
    bool present = false;
    Eigen::RowVectorXd voltages;  ///< oldest first, the newest is one period old
    // Of the voltages filtered as the velocities are (Predictor::Linear).
    double now = 0.0, next = 0.0, motor = 0.0;
    double fraction = 0.0, m1 = 0.0, m0 = 0.0, motor_decay = 0.0, motor_gain = 0.0;
  };
  /// How a voltage of some periods ago enters the states.
  struct Entry {
    int periods;
    Eigen::VectorXd per_volt;
    bool actuator;  ///< into the plant; else into what the estimator believes
  };

  void add_velocity_estimator(const ControlConfig& config, const Eigen::Vector2d& scale);
  void add_state_estimator(const ControlConfig& config, const Plant& plant, const Eigen::Vector2d& scale);
  void add_prediction(const ControlConfig& config);
  void resize(Eigen::Index states);
  /// Change of what the sensors show over a period: from the states and the voltage that acts.
  std::complex<double> predicted_voltages(std::complex<double> z) const;
  double remembered_periods(double delay_s) const;
  std::vector<double> shares(double delay_s) const;
  void enter_voltages(Eigen::MatrixXd& matrix, const Eigen::RowVectorXd& volt, Eigen::Index first_volt,
                      double actuator_delay_s) const;

  double period_s_;
  ExtraDelay extra_;
  double base_delay_s_ = 0.0;    ///< that the result comes on top of
  double lined_delay_s_ = 0.0;   ///< in the delay line in any case
  Eigen::MatrixXd a_;            ///< plant, the last voltage (for a fractional input delay), estimator
  std::vector<Entry> entries_;   ///< the first is the actuator's
  Eigen::MatrixXd shows_;        ///< 6 x states: what a ControlState holds
  Eigen::RowVectorXd fed_back_;  ///< 1 x 6, on it
  Prediction prediction_;
};

}  // namespace upright
