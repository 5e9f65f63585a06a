// A Kalman filter that predicts with the nonlinear equations of the plant file: sine and cosine, dry
// friction with sticking or bristles, and all other effects. The estimated force on the cart is the
// remaining model error.
//
// Measurements update the prediction with the stationary gain of the sliding plant (`kalman_gain`). A
// gain that followed the contact would discard the force estimate at rest, where forces below the
// breakaway level are not observable, although it decides when the cart breaks away.
//
// For `friction_compensation` the model's dry friction is part of the force to be cancelled, after a
// first-order lag. While sliding it is the level opposing the motion. At rest it is the holding force:
// cancelling it raises the voltage until the cart breaks away, at a rate set by the lag.
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
  double encoder_ahead_m() const noexcept override;
  double rejected_force_n() const noexcept override;

  PlantState<double> plant_state(double drive_v) const noexcept;
  void take(const PlantState<double>& state) noexcept;
  double friction_n() const noexcept;

  EventEngine<double> engine_;
  double period_s_, early_s_, volts_per_newton_;
  bool encoder_differs_;  ///< from the cart, beyond scale and offset
  double friction_share_, friction_follows_;
  double friction_lagged_n_ = 0.0;
};

}  // namespace upright
