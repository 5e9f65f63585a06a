// How much delay a loop bears: of the continuous loop V(t) = gains . state(t - delay), and of the sampled
// loop as it runs. A delay here is the gain file's `delay_s`; the plant's own input delay comes on top of it.
#pragma once

#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "upright/control/gain_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// A frequency at which the loop gain is 1, and the smallest delay that puts a root there on the stability
/// boundary.
struct Crossing {
  double frequency_radps = 0.0;
  double delay_s = 0.0;
  bool destabilizing = false;  ///< with growing delay the root moves into instability
};

/// The rightmost characteristic root on either side of the critical delay [1/s].
struct Confirmation {
  double below_s = 0.0, above_s = 0.0;
  std::complex<double> below, above;
  bool confirmed = false;  ///< stable below, unstable above
};

struct LoopMargin {
  /// At delay zero; with a predictor, at the delay it makes up for.
  bool stable_without_delay = false;
  std::complex<double> root_without_delay;
  /// Where stability is lost first. Zero when it is not there without delay, infinite when no delay takes it.
  double critical_delay_s = 0.0;
  double crossing_radps = 0.0;      ///< frequency there; 0 when there is none
  std::vector<Crossing> crossings;  ///< by rising delay
  std::optional<Confirmation> confirmation;
};

/// Linearises with sgn(v) as tanh(smoothing v). With a predictor the continuous loop is the one without it.
/// Throws ConfigError.
LoopMargin continuous_margin(const Plant& plant, const Gains& gains, double smoothing);

/// Hold, velocity estimator, delay line with its interpolation, and predictor included. `confirm`: find the
/// roots on both sides, which takes longer the longer the delay.
LoopMargin sampled_margin(const Plant& plant, const ControlConfig& config, double smoothing,
                          bool confirm = true);

/// What a run may lose in time before its gains no longer hold the pendulum.
struct OverrunTolerance {
  double extra_delay_s = 0.0;  ///< beyond the configured delay; 0 when the loop is beyond it already
  int missed_periods = 0;      ///< consecutive, such that the voltage held over them is not older than that
  bool sliding =
      true;  ///< of the plant without its dry friction, which large motions feel; else of the smoothed
  std::string sentence;  ///< for the user
};

/// From the sampled loop. The sliding plant counts, since it bears less and is what a disturbed pendulum
/// meets; where the gains do not stabilize it at the configured delay, the smoothed plant does.
OverrunTolerance overrun_tolerance(const Plant& plant, const ControlConfig& config, double smoothing = 100.0);

}  // namespace upright
