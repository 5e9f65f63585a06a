// How much delay a loop bears: of the continuous loop V(t) = gains . state(t - delay), and of the sampled
// loop as it runs. A delay here is the gain file's `delay_s`; the plant's own input delay comes on top of it.
#pragma once

#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "linear_sampled_loop.hpp"
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

/// Linearises with sgn(v) as tanh(smoothing v). A state estimator is taken as it is without a period; with a
/// predictor the continuous loop is the one without it, and so it is with a velocity estimator. Throws
/// ConfigError.
LoopMargin continuous_margin(const Plant& plant, const ControlConfig& config, double smoothing);
/// The same of the true state fed back.
LoopMargin continuous_margin(const Plant& plant, const Gains& gains, double smoothing);

/// Hold, estimator, delay line with its interpolation, and predictor included. `confirm`: find the roots on
/// both sides, where the delay is not too long for it (LinearSampledLoop::most_periods). `extra`: whether the
/// delay is the gain file's, which a state estimator knows of, or one of the actuator that it does not know
/// of, on top of the gain file's.
LoopMargin sampled_margin(const Plant& plant, const ControlConfig& config, double smoothing,
                          bool confirm = true, ExtraDelay extra = ExtraDelay::known);

/// The plant as motions far larger than stick-slip and cogging feel it: without dry friction, and without
/// cogging, which averages out over its pitch.
Plant large_motion_plant(const Plant& plant);

/// What a run may lose in time before its gains no longer hold the pendulum. The sliding plant decides, since
/// it bears less than one near rest, and is what a disturbed pendulum meets.
struct OverrunTolerance {
  bool stabilized = false;  ///< by the gains, without delay
  double critical_delay_s =
      0.0;                     ///< sampled, sliding; 0 where there is none, infinite when no delay takes it
  double extra_delay_s = 0.0;  ///< beyond the configured delay; 0 when the loop is beyond it already
  int missed_periods = 0;      ///< consecutive, such that the voltage held over them is not older than that
  std::string sentence;        ///< for the user

  /// The loop will oscillate or fall.
  bool exceeded() const { return extra_delay_s <= 0.0; }
};

/// From the sampled loop on the large-motion plant. Throws ConfigError.
OverrunTolerance overrun_tolerance(const Plant& plant, const ControlConfig& config);

}  // namespace upright
