// Delay compensation: the state at the time the next voltage acts, from the delayed state and every voltage
// that is on its way. In the loop it allocates, locks and throws nothing; its cost grows with the delay (four
// products for each buffered voltage).
//
// The model is the plant file's while the cart slides (dry levels and bristles taken out: they change no
// slope; a sprung mass fixed to the cart, a rigid rod), as an exact sampled line s' = a s + b u + f. The
// static actuator chain (dead zone, gain, offset, saturation) is not linearised: the buffered voltages go
// through it. input_delay is looked through as well, motor_lag is a state that follows from the voltages.
//
// Whether the measurement or the voltage is late makes no difference to the loop: with a total delay of d
// periods the state d periods after the newest one known is a^d s plus what d known voltages add.
//
// The velocities come late through their filter too. With the filter N(z) / M(z) from position to velocity,
// the line's s = M(a) q + ... with q the state filtered by 1 / M(z) and driven by the voltage filtered alike,
// which is known; so (x, theta, filtered x', filtered theta') is an invertible linear map of q, and s follows
// exactly.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

#include "predictor_step.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/control/state_estimator.hpp"
#include "upright/control/velocity_estimator.hpp"
#include "upright/model/dynamics.hpp"
#include "upright/model/plant.hpp"

namespace upright {

class Predictor final : public DelayCompensator {
 public:
  /// Predicts for a loop of this configuration (delay, rate, estimator) with this plant as the model. Throws
  /// ConfigError when the plant cannot be predicted with.
  Predictor(const ControlConfig& config, const Plant& plant);

  void start(const ControlState& state) noexcept override;
  ControlState compensate(const ControlState& delayed, double applied_v) noexcept override;

  /// How far it looks ahead: the loop's delay and the plant's input delay.
  double horizon_s() const { return horizon_s_; }

  /// What `compensate` gives, per unit of what the sensors show and per volt commanded, for analysis.
  /// `voltages`: oldest first, the newest is one period old. `next`, `now` and `motor` multiply the filtered
  /// voltages, with next(k) = u(k) - m1 next(k - 1) - m0 now(k - 1), now(k) = next(k - 1), motor(k) =
  /// motor_decay motor(k - 1) + motor_gain now(k - 1), where u is the voltage that acted before the
  /// measurement: (1 - fraction) times the one as old as the oldest of `voltages`, fraction times the one
  /// before it.
  struct Linear {
    Eigen::Matrix4d measured;
    Eigen::Matrix4Xd voltages;
    Eigen::Vector4d now, next, motor;
    double fraction, m1, m0, motor_decay, motor_gain;
  };
  Linear linear() const;
  /// What the feedback by these gains amounts to, to simulate many loops side by side, and the model of whose
  /// static actuator chain.
  FeedbackPrediction feedback(const Gains& gains) const;
  const PlantModel<double>& model() const { return actuator_.model(); }

 private:
  /// Fed-back states and, last, the motor's voltage (zero rows and columns where it does not lag).
  static constexpr int model_states = 5;
  using Vector = Eigen::Matrix<double, model_states, 1>;
  using Matrix = Eigen::Matrix<double, model_states, model_states>;
  struct Line {
    Matrix a;
    Vector b, f;
  };
  /// The state at the sample from what is measured there.
  struct Recovery {
    Eigen::Matrix<double, model_states, 4> measured;
    Vector now, next, motor, constant;
  };

  static Line sampled_line(const Eigen::MatrixXd& a, const Eigen::VectorXd& b, const Eigen::VectorXd& f,
                           double duration_s);
  Recovery recover(const Line& line, const EstimatorStep& filter);
  void combine(const Line& line, const Line& part, const Recovery& recovery);
  void take(double drive_v) noexcept;
  ControlState shown(const Eigen::Vector4d& state) const noexcept;

  /// `compensate` for true states and drive voltages, as numbers.
  struct Weights {
    Eigen::Matrix4d measured;
    Eigen::Matrix4Xd on_their_way;  ///< oldest first; the first column is for a part of a period
    Eigen::Vector4d filtered_now, filtered_next, filtered_motor;
    Eigen::Vector4d constant;
  };

  Dynamics<double> actuator_;
  double slope_ = 1.0;  ///< of the actuator chain, off a dead zone
  double horizon_s_ = 0.0;
  std::size_t whole_ = 0;       ///< periods of the horizon
  double fraction_ = 0.0;       ///< and the rest of one
  std::size_t free_steps_ = 0;  ///< periods from the start on until a measurement is from after the start
  Eigen::Vector4d scale_, offset_;
  PredictorStep step_, lead_;  ///< over a period; over the input delay
  VoltageFilter filter_;
  Weights weights_;

  std::vector<double> drives_;  ///< a ring kept twice, so that its window is contiguous
  std::size_t window_ = 0;      ///< length of the window: whole_ + 2
  std::size_t first_ = 0;       ///< its oldest entry
  VoltageFilter::State<double> filtered_;
  std::size_t steps_ = 0;
  PredictorStep::Column free_state_{};
};

}  // namespace upright
