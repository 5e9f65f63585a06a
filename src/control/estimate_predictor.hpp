// Delay compensation behind a state estimator: the delayed estimate, with the force on the cart that it
// holds, carried through every voltage that is on its way. In the loop it allocates, locks and throws
// nothing; its cost grows with the delay (a few products for each buffered voltage).
//
// The force fades with the time constant `disturbance_rejection: decay_s` as it is carried forward: friction
// that holds now has turned round half a swing later.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "filter_model.hpp"
#include "upright/control/state_estimator.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

class EstimatePredictor final : public DelayCompensator {
 public:
  /// Throws ConfigError when the plant cannot be predicted with.
  EstimatePredictor(const ControlConfig& config, const Plant& plant);

  void start(const ControlState& state) noexcept override;
  ControlState compensate(const ControlState& delayed, double applied_v) noexcept override;

  /// What `compensate` gives for what the estimator shows (its rows and columns: the four fed back in
  /// sensors' units, motor, force), and per volt commanded, oldest first; the newest is one period old.
  struct Linear {
    Eigen::Matrix<double, 6, 6> estimate;
    Eigen::Matrix<double, 6, Eigen::Dynamic> voltages;
  };
  Linear linear() const;

 private:
  static constexpr int carried = 6;  ///< all but the angle's zero, which the estimate has been freed of
  using Vector = Eigen::Matrix<double, carried, 1>;
  using Matrix = Eigen::Matrix<double, carried, carried>;

  void take(double drive_v) noexcept;
  Vector true_state(const ControlState& shown) const noexcept;
  ControlState shown(const Vector& state) const noexcept;

  Dynamics<double> actuator_;
  double slope_ = 1.0;
  Vector scale_;
  Matrix a_ = Matrix::Identity();  ///< over the horizon
  Vector constant_ = Vector::Zero();
  Eigen::Matrix<double, carried, Eigen::Dynamic>
      on_their_way_;        ///< oldest first; the first for a part of a period
  Matrix step_a_, lead_a_;  ///< over a period; over the input delay
  Vector step_b_, step_constant_, lead_b_, lead_constant_;
  std::size_t free_steps_ = 0;  ///< periods from the start on until an estimate is from after the start

  std::vector<double> drives_;  ///< a ring kept twice, so that its window is contiguous
  std::size_t window_ = 0;
  std::size_t first_ = 0;
  std::size_t steps_ = 0;
  Vector free_state_;
  double turn_rad_ = 0.0;
};

}  // namespace upright
