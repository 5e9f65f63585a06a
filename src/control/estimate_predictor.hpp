// Delay compensation for a state estimator: predicts the delayed estimate, including its force on the
// cart, through all voltages that have been commanded since. In the loop it does not allocate, lock or
// throw. Its cost grows with the delay (a few products per buffered voltage).
//
// In the prediction the force decays with the time constant `disturbance_rejection: decay_s`, since the
// present friction has reversed half a swing later.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "filter_model.hpp"
#include "predictor_step.hpp"
#include "upright/control/state_estimator.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

class EstimatePredictor final : public DelayCompensator {
 public:
  /// Throws ConfigError when prediction with the plant is impossible.
  EstimatePredictor(const ControlConfig& config, const Plant& plant);

  void start(const ControlState& state) noexcept override;
  ControlState compensate(const ControlState& delayed, double applied_v) noexcept override;

  /// `compensate` as a linear function of the estimate (the four fed-back states in sensor units, motor,
  /// force) and of the commanded voltages (oldest first, the newest is one period old).
  struct Linear {
    Eigen::Matrix<double, 6, 6> estimate;
    Eigen::Matrix<double, 6, Eigen::Dynamic> voltages;
  };
  Linear linear() const;
  /// What the feedback by these gains amounts to, with `volts_per_newton` of the predicted force, to simulate
  /// many loops side by side, and the model of whose static actuator chain.
  FeedbackPrediction feedback(const Gains& gains, double volts_per_newton) const;
  const PlantModel<double>& model() const { return actuator_.model(); }

 private:
  static constexpr int carried =
      predicted_states;  ///< all states but the angle's zero, which is removed from the estimate
  using Vector = Eigen::Matrix<double, carried, 1>;
  using Matrix = Eigen::Matrix<double, carried, carried>;

  void take(double drive_v) noexcept;
  Vector true_state(const ControlState& shown) const noexcept;
  ControlState shown(const Vector& state) const noexcept;

  Dynamics<double> actuator_;
  double slope_ = 1.0;
  Vector scale_;
  Matrix a_ = Matrix::Identity();  ///< over the prediction horizon
  Vector constant_ = Vector::Zero();
  Eigen::Matrix<double, carried, Eigen::Dynamic>
      on_their_way_;            ///< oldest first; the first for a fraction of a period
  PredictorStep step_, lead_;   ///< over a period; over the input delay
  std::size_t free_steps_ = 0;  ///< periods from the start until the estimate dates from after the start

  std::vector<double> drives_;  ///< a ring stored twice, so that its window is contiguous
  std::size_t window_ = 0;
  std::size_t first_ = 0;
  std::size_t steps_ = 0;
  PredictorStep::Column free_state_{};
  double turn_rad_ = 0.0;
};

}  // namespace upright
