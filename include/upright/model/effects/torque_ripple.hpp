// torque_ripple: the motor's constant varies along the track, as its poles and commutator pass.
#pragma once

#include <cmath>

#include "upright/model/effect.hpp"
#include "upright/model/elementary.hpp"

namespace upright::effects {

/// The motor's constant varies along the track, as its poles and commutator pass. It is in the force per
/// current and in the back-EMF, so its square is in the force that the back-EMF causes.
struct TorqueRipple {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"share", "1", (Range{0.0, 0.95}), 0.0, 0.1, "r: largest change, as a share of the constant"},
      {"pitch_m", "m", Range::positive(), no_neutral, 0.01, "p: distance from one crest to the next"},
      {"phase_rad", "rad", Range::any(), no_neutral, 0.0, "phase at x = 0"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"torque_ripple",
                                   Enters::cart,
                                   false,
                                   "k -> k (1 + s), beta -> beta (1 + s)^2, s = r sin(2 pi x / p + phase)",
                                   "the motor is stronger at some of its angles than at others",
                                   parameters};

  /// By how much the motor's constant is larger at x, as a share of it.
  template <class S>
  static S motor_ripple(const S* p, const S& x) {
    return p[0] * elementary::sin(two_pi * x / p[1] + p[2]);
  }

  /// Its greatest rate [1/s].
  static double rate_radps(const double* p, double v, double /*mass*/) { return two_pi * std::abs(v) / p[1]; }

 private:
  static constexpr double two_pi = 6.283185307179586;
};

}  // namespace upright::effects
