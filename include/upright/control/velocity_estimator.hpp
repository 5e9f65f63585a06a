// Estimation of velocities from sampled positions.
#pragma once

#include <cstdint>

namespace upright {

/// How velocities follow from positions.
enum class EstimatorKind : std::uint8_t {
  second_order_filter,  ///< wc^2 s / (s^2 + 2 zeta wc s + wc^2), as on Quanser rigs
  difference,           ///< (x_k - x_{k-1}) / T
  device,               ///< as the rig's device measures them; simulations and margins take `difference`
};

/// Section `velocity_estimator` of a gain file.
struct EstimatorConfig {
  EstimatorKind kind = EstimatorKind::second_order_filter;  ///< filter, difference or device
  double cutoff_hz = 50.0;                                  ///< wc / (2 pi)
  double damping = 0.9;                                     ///< zeta
};

/// One step of an estimator in coefficients, for the loop and for engines with many lanes:
///   velocity' = p21 lag + p22 velocity + g2 dx
///   lag'      = p11 lag + p12 velocity + g1 dx
/// where dx = x' - x and lag = filtered position - position. The backward difference is the same step
/// with g2 = 1 / T and all other coefficients zero.
///
/// The filter is discretised with a first-order hold (ramp invariance). It is exact when the position is
/// linear between samples, the appropriate assumption for an encoder on a body with inertia. After the
/// transient, a constant gives exactly zero and a ramp its exact slope, at any sampling rate.
struct EstimatorStep {
  double p11 = 0.0;  ///< from lag to lag
  double p12 = 0.0;  ///< from velocity to lag
  double p21 = 0.0;  ///< from lag to velocity
  double p22 = 0.0;  ///< from velocity to velocity
  double g1 = 0.0;   ///< from dx to lag
  double g2 = 0.0;   ///< from dx to velocity
};

/// Throws ConfigError when the configuration is invalid for this period.
EstimatorStep make_estimator_step(const EstimatorConfig& config, double period_s);

/// Estimates the velocity of one coordinate.
class VelocityEstimator {
 public:
  /// Starts at rest at 0: call `start` with the first sample.
  explicit VelocityEstimator(const EstimatorStep& step) : step_(step) {}

  /// Starts at rest at `position`.
  void start(double position) noexcept {
    position_ = position;
    lag_ = 0.0;
    velocity_ = 0.0;
  }

  /// Takes the position of the next period and returns the velocity there.
  double step(double position) noexcept {
    const double dx = position - position_;
    const double velocity = step_.p21 * lag_ + step_.p22 * velocity_ + step_.g2 * dx;
    lag_ = step_.p11 * lag_ + step_.p12 * velocity_ + step_.g1 * dx;
    velocity_ = velocity;
    position_ = position;
    return velocity;
  }

  /// The latest estimate [units of the samples per s].
  double velocity() const noexcept { return velocity_; }
  double position() const noexcept { return position_; }  ///< the latest sample

 private:
  EstimatorStep step_;
  double position_ = 0.0, lag_ = 0.0, velocity_ = 0.0;
};

}  // namespace upright
