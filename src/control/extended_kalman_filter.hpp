// A Kalman filter that predicts with the plant file's own physics: sine and cosine, dry friction that sticks
// and slips or its bristles, and every other effect that the file has. The force on the cart that it
// estimates is then what the file lacks.
//
// Readings correct the prediction by the stationary gain of the sliding plant (`kalman_gain`): a resting cart
// shows no force below its breakaway level, so that a gain that followed the contact would let go of the
// force just when it decides when the cart moves on.
//
// The dry friction of the model is shown as a part of the force to be taken away (`friction_compensation`),
// behind a first-order lag. While the cart slides it is the level against the motion; while it rests, what
// holds it: taking that away lets the voltage grow until the cart moves, at the rate that the lag sets.
#pragma once

#include "kalman_filter.hpp"
#include "upright/sim/event_engine.hpp"

namespace upright {

class ExtendedKalmanFilter final : public KalmanFilter {
 public:
  /// Throws ConfigError when there is no stationary filter for this plant.
  ExtendedKalmanFilter(const ControlConfig& config, const Plant& plant);

  void start(double cart_m, double theta_rad) noexcept override;

 private:
  void propagate(double late_v, double early_v) noexcept override;
  double drive_yields_m() const noexcept override;
  double rejected_force_n() const noexcept override;

  PlantState<double> plant_state(double drive_v) const noexcept;
  void take(const PlantState<double>& state) noexcept;
  double friction_n() const noexcept;

  EventEngine<double> engine_;
  double period_s_, early_s_, volts_per_newton_;
  bool yields_;
  double friction_share_, friction_follows_;
  double friction_lagged_n_ = 0.0;
};

}  // namespace upright
