// One closed-loop simulation from an initial angle with a delay, reduced to the results of a sweep:
// whether the pendulum fell, and the amplitude of the remaining motion. Several independent engines can
// be compared.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>

#include "upright/control/controller.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

/// Settings that all runs of a sweep share.
struct LoopSetup {
  PlantModel<double> model;  ///< the plant
  ControlConfig control;     ///< `delay_s` is ignored: each run has its own
  /// Continuous: V(t) = gains . y(t - delay), with the true velocities. Sampled: the control step at the
  /// gain file's rate, with velocity estimator, encoder resolution and amplifier limit.
  bool sampled = false;
  double cart_resolution_m = 0.0;     ///< sampled: resolution of the encoder; 0: exact
  double angle_resolution_rad = 0.0;  ///< sampled: resolution of the encoder; 0: exact
  double amplifier_limit_v = 1e6;     ///< sampled; the default is above any command
  double duration_s = 20.0;           ///< of each run [s]
  double fell_above_rad = 1.0;        ///< a run ends where |theta| reaches this
  /// Makes the estimator and the compensator of a sampled loop for one delay; empty: neither.
  std::function<ModelParts(const ControlConfig&)> make_parts;

  /// Amplitudes are evaluated over the last third of the run.
  double window_begin_s() const { return duration_s * (2.0 / 3.0); }
};

/// Released at rest at an angle with the cart at 0 and constant history (paper, equation (15)).
struct LoopCase {
  double theta0_rad = 0.0;  ///< initial angle [rad]
  double delay_s = 0.0;     ///< delay of the feedback [s]
};

/// What one run did.
struct LoopResult {
  double fall_time_s = std::numeric_limits<double>::quiet_NaN();  ///< NaN: it did not fall
  /// Half of peak to peak over the last third; for a run that fell, the largest absolute value.
  double theta_amplitude_rad = 0.0;
  double cart_amplitude_m = 0.0;  ///< half of the range of the cart within the window [m]
  /// Root mean square of the commanded voltage over the last third, of a sampled loop that did not fall;
  /// NaN: of another.
  double voltage_rms_v = std::numeric_limits<double>::quiet_NaN();
  PlantState<double> end;  ///< final state

  bool fell() const { return fall_time_s == fall_time_s; }  ///< whether the pendulum fell
};

/// Extremes of angle and position over the last third, and the largest absolute values until a fall.
class MotionRange {
 public:
  /// `window_begin_s`: from when on the range counts [s].
  explicit MotionRange(double window_begin_s) : window_begin_s_(window_begin_s) {}

  /// Takes one sample.
  void take(double time_s, double theta_rad, double cart_m) {
    theta_max_ = std::max(theta_max_, std::abs(theta_rad));
    cart_max_ = std::max(cart_max_, std::abs(cart_m));
    if (time_s < window_begin_s_) return;
    theta_low_ = std::min(theta_low_, theta_rad);
    theta_high_ = std::max(theta_high_, theta_rad);
    cart_low_ = std::min(cart_low_, cart_m);
    cart_high_ = std::max(cart_high_, cart_m);
  }

  /// Writes the amplitudes.
  void into(LoopResult& result) const {
    result.theta_amplitude_rad = result.fell() ? theta_max_ : 0.5 * (theta_high_ - theta_low_);
    result.cart_amplitude_m = result.fell() ? cart_max_ : 0.5 * (cart_high_ - cart_low_);
  }

 private:
  static constexpr double infinite = std::numeric_limits<double>::infinity();
  double window_begin_s_;
  double theta_max_ = 0.0, cart_max_ = 0.0;
  double theta_low_ = infinite, theta_high_ = -infinite, cart_low_ = infinite, cart_high_ = -infinite;
};

/// Called after each period (sampled) or slice (continuous): time, state, commanded voltage.
using LoopObserver = std::function<void(double time_s, const PlantState<double>& state, double voltage_v)>;

/// Simulates one run with the event engine (Runge-Kutta with stick-slip events).
LoopResult run_with_events(const LoopSetup& setup, const LoopCase& start, const LoopObserver& observer = {});

/// Simulates one run with CVODE: slow and accurate, independent of the other engines.
LoopResult run_with_reference(const LoopSetup& setup, const LoopCase& start,
                              const LoopObserver& observer = {});

}  // namespace upright
