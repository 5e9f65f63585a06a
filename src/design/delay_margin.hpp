// Delay margins of the continuous loop V(t) = gains . state(t - delay) and of the sampled loop. A delay
// here is the gain file's `delay_s`; the plant's own input delay is added to it.
#pragma once

#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "linear_sampled_loop.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// A frequency with unit loop gain, and the smallest delay for which a root crosses the stability
/// boundary there.
struct Crossing {
  double frequency_radps = 0.0;
  double delay_s = 0.0;
  bool destabilizing = false;  ///< with increasing delay the root crosses into instability
};

/// The rightmost characteristic root below and above the critical delay [1/s].
struct Confirmation {
  double below_s = 0.0, above_s = 0.0;
  std::complex<double> below, above;
  bool confirmed = false;  ///< stable below, unstable above
};

struct LoopMargin {
  /// At delay zero; with a predictor, at the delay that it compensates.
  bool stable_without_delay = false;
  std::complex<double> root_without_delay;
  /// Smallest delay at which stability is lost. 0: unstable without delay; infinite: always stable.
  double critical_delay_s = 0.0;
  double crossing_radps = 0.0;      ///< frequency of that crossing; 0 when there is none
  std::vector<Crossing> crossings;  ///< by increasing delay
  std::optional<Confirmation> confirmation;
};

/// Linearises with sgn(v) as tanh(smoothing v). A state estimator is treated as continuous. A
/// predictor and a velocity estimator are neglected in the continuous loop. Throws
/// ConfigError.
LoopMargin continuous_margin(const Plant& plant, const ControlConfig& config, double smoothing);
/// The same with feedback of the true state.
LoopMargin continuous_margin(const Plant& plant, const Gains& gains, double smoothing);

/// Includes hold, estimator, delay line with interpolation, and predictor. `confirm`: compute the roots
/// on both sides, if the delay is not too long for it (LinearSampledLoop::max_periods). `extra`: whether
/// the delay is the gain file's, which a state estimator models, or an unmodelled delay of the actuator
/// in addition to the gain file's.
LoopMargin sampled_margin(const Plant& plant, const ControlConfig& config, double smoothing,
                          bool confirm = true, ExtraDelay extra = ExtraDelay::known);

/// The plant in the limit of motions far larger than stick-slip and cogging: without dry friction, and
/// without effects that repeat along the track, which average out over their pitch.
Plant large_motion_plant(const Plant& plant);

/// The additional delay of a run for which its gains still stabilise the pendulum. It is computed for the
/// sliding plant, which tolerates less than the plant near rest and describes a disturbed pendulum.
struct OverrunTolerance {
  bool stabilized = false;        ///< by the gains, without delay
  double critical_delay_s = 0.0;  ///< sampled, sliding; 0: unstable, infinite: stable for any delay
  double extra_delay_s = 0.0;     ///< beyond the configured delay; 0 when the loop already exceeds it
  int missed_periods =
      0;  ///< largest number of consecutive periods over which a held voltage is not older than that
  std::string sentence;  ///< for the user

  /// Whether the loop will oscillate or fall.
  bool exceeded() const { return extra_delay_s <= 0.0; }
};

/// Computed from the sampled loop on the large-motion plant. Throws ConfigError.
OverrunTolerance overrun_tolerance(const Plant& plant, const ControlConfig& config);

}  // namespace upright
