// One closed-loop run from a starting angle under a delay, reduced to what a sweep wants to know: did it
// fall, and how large is the motion that is left. Several engines give it; each is a witness against the
// others.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>

#include "upright/control/controller.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

/// What all runs of a sweep have in common.
struct LoopSetup {
  PlantModel<double> model;
  ControlConfig control;  ///< its `delay_s` is not used: each run has its own
  /// Continuous: V(t) = gains . y(t - delay), true velocities. Sampled: the control step at the gain file's
  /// rate, with its velocity estimator, the encoders' steps and the amplifier's limit.
  bool sampled = false;
  double cart_resolution_m = 0.0;     ///< sampled: step of the encoder; 0: none
  double angle_resolution_rad = 0.0;  ///< sampled: step of the encoder; 0: none
  double amplifier_limit_v = 1e6;     ///< sampled; the default is out of reach of any loop
  double duration_s = 20.0;
  double fell_above_rad = 1.0;  ///< a run ends where |theta| reaches this
  /// Makes the estimator and the compensator of a sampled loop for one delay; empty: neither.
  std::function<ModelParts(const ControlConfig&)> make_parts;

  /// The amplitudes are taken over the last third of the run.
  double window_begin_s() const { return duration_s * (2.0 / 3.0); }
};

/// Released at rest at an angle with the cart at 0, the history before that being the same (paper, (15)).
struct LoopCase {
  double theta0_rad = 0.0;
  double delay_s = 0.0;
};

struct LoopResult {
  double fall_time_s = std::numeric_limits<double>::quiet_NaN();  ///< not a number: it did not fall
  /// Half of peak to peak over the last third; of a run that fell, the largest value until then.
  double theta_amplitude_rad = 0.0;
  double cart_amplitude_m = 0.0;
  PlantState<double> end;  ///< where the run ended

  bool fell() const { return fall_time_s == fall_time_s; }
};

/// Smallest and largest angle and position over the last third, and the largest until a fall.
class MotionRange {
 public:
  explicit MotionRange(double window_begin_s) : window_begin_s_(window_begin_s) {}

  void take(double time_s, double theta_rad, double cart_m) {
    theta_most_ = std::max(theta_most_, std::abs(theta_rad));
    cart_most_ = std::max(cart_most_, std::abs(cart_m));
    if (time_s < window_begin_s_) return;
    theta_low_ = std::min(theta_low_, theta_rad);
    theta_high_ = std::max(theta_high_, theta_rad);
    cart_low_ = std::min(cart_low_, cart_m);
    cart_high_ = std::max(cart_high_, cart_m);
  }

  void into(LoopResult& result) const {
    result.theta_amplitude_rad = result.fell() ? theta_most_ : 0.5 * (theta_high_ - theta_low_);
    result.cart_amplitude_m = result.fell() ? cart_most_ : 0.5 * (cart_high_ - cart_low_);
  }

 private:
  static constexpr double infinite = std::numeric_limits<double>::infinity();
  double window_begin_s_;
  double theta_most_ = 0.0, cart_most_ = 0.0;
  double theta_low_ = infinite, theta_high_ = -infinite, cart_low_ = infinite, cart_high_ = -infinite;
};

/// Called after every period (sampled) or slice (continuous) of a run: time, state, voltage commanded.
using LoopObserver = std::function<void(double time_s, const PlantState<double>& state, double voltage_v)>;

/// The run by the event engine (Runge-Kutta, true stick-slip), one at a time.
LoopResult run_with_events(const LoopSetup& setup, const LoopCase& start, const LoopObserver& observer = {});

/// The run by CVODE: slow, tight, independent of the others.
LoopResult run_with_reference(const LoopSetup& setup, const LoopCase& start,
                              const LoopObserver& observer = {});

}  // namespace upright
