// The linearised sampled loop: plant with held voltage, input delay and motor lag, velocity or state
// estimator, delay line with interpolation, state feedback, and the predictor where the gain file has
// one.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

#include "frequency_response.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// Where a delay in addition to the gain file's occurs.
enum class ExtraDelay : std::uint8_t {
  known,       ///< in the delay line: `delay_s`, which a state estimator models
  unmodelled,  ///< in the actuator: not modelled by the estimator and the predictor
};

class LinearSampledLoop {
 public:
  /// Linearises `plant` with sgn(v) as tanh(smoothing v). Reads the plants of the estimator and the
  /// predictor where there are any. Throws ConfigError.
  LinearSampledLoop(const Plant& plant, const ControlConfig& config, double smoothing,
                    ExtraDelay extra = ExtraDelay::known);

  double period_s() const { return period_s_; }
  /// The part of the loop's delay to which `delay_s` below is added. Known: the predictor's own, or none;
  /// unmodelled: the gain file's.
  double base_delay_s() const { return base_delay_s_; }

  /// V = transfer(z) * line(z, delay) * V is the characteristic equation; transfer does not contain the
  /// added delay.
  std::complex<double> transfer(std::complex<double> z) const;
  /// z^-d ((1 - f) + f / z) for a delay of d + f periods: the delay line with interpolation.
  std::complex<double> line(std::complex<double> z, double delay_s) const;

  /// Largest number of periods of delay, prediction and input delay for which roots are computed: about 5
  /// s of computing.
  static constexpr double max_periods = 1200.0;
  /// Whether the loop has at most that many.
  bool has_roots(double delay_s) const;
  /// The state matrix of the closed loop over one period; stable if all eigenvalues are inside the unit
  /// circle. Throws ConfigError for a loop with too many states.
  Eigen::MatrixXd closed_loop(double delay_s) const;
  /// log(z) / T of the root z of largest magnitude [1/s]. Throws as closed_loop does.
  std::complex<double> rightmost_root(double delay_s) const;

 private:
  /// The fed-back quantity as a linear function of the estimate and of the commanded voltages, per volt.
  struct Prediction {
    bool present = false;
    Eigen::RowVectorXd voltages;  ///< oldest first, the newest is one period old
    // Voltages filtered as the velocities are (Predictor::Linear).
    double now = 0.0, next = 0.0, motor = 0.0;
    double fraction = 0.0, m1 = 0.0, m0 = 0.0, motor_decay = 0.0, motor_gain = 0.0;
  };
  /// How the voltage of an earlier period enters the states.
  struct Entry {
    int periods;
    Eigen::VectorXd per_volt;
    bool actuator;  ///< into the plant; else into the model of the estimator
  };

  void add_velocity_estimator(const ControlConfig& config, const Eigen::Vector2d& scale);
  void add_state_estimator(const ControlConfig& config, const Plant& plant, const Eigen::Vector2d& scale);
  void add_prediction(const ControlConfig& config);
  void resize(Eigen::Index states);
  /// Change of the sensors' values over a period, from the states and the acting voltage.
  std::complex<double> predicted_voltages(std::complex<double> z) const;
  double remembered_periods(double delay_s) const;
  std::vector<double> shares(double delay_s) const;
  void enter_voltages(Eigen::MatrixXd& matrix, const Eigen::RowVectorXd& volt, Eigen::Index first_volt,
                      double actuator_delay_s) const;

  double period_s_;
  ExtraDelay extra_;
  double base_delay_s_ = 0.0;    ///< the delay to which the added one refers
  double lined_delay_s_ = 0.0;   ///< in the delay line in any case
  Eigen::MatrixXd a_;            ///< plant, last voltage (for a fractional input delay), estimator
  std::vector<Entry> entries_;   ///< the first is the actuator's
  Eigen::MatrixXd shows_;        ///< 6 x states: the contents of a ControlState
  Eigen::RowVectorXd fed_back_;  ///< 1 x 6, of the fed-back states
  Prediction prediction_;
  FrequencyResponse response_;  ///< of what is fed back to each of the entries
};

}  // namespace upright
