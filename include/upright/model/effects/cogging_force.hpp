// cogging_force: a force that is periodic along the track, caused by teeth or magnets.
#pragma once

#include <cmath>

#include "upright/model/effect.hpp"
#include "upright/model/elementary.hpp"

namespace upright::effects {

/// A force that is periodic along the track, caused by teeth or magnets.
struct CoggingForce {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"amplitude_n", "N", Range::not_negative(), 0.0, 0.3, "A: amplitude"},
      {"pitch_m", "m", Range::positive(), no_neutral, 0.01, "p: distance from one crest to the next"},
      {"phase_rad", "rad", Range::any(), no_neutral, 0.0, "phase at x = 0"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"cogging_force",
                                   Enters::cart,
                                   false,
                                   "F = A sin(2 pi x / p + phase)",
                                   "a force that repeats along the track: teeth, magnets",
                                   parameters};

  /// Force on the cart [N].
  template <class S>
  static S cart_force(const S* p, const S& x, const S& /*v*/) {
    return p[0] * elementary::sin(two_pi * x / p[1] + p[2]);
  }

  /// Its greatest rate [1/s].
  static double rate_radps(const double* p, double v, double mass) {
    return two_pi * std::abs(v) / p[1] + std::sqrt(two_pi * std::abs(p[0]) / (p[1] * mass));
  }

 private:
  static constexpr double two_pi = 6.283185307179586;
};

}  // namespace upright::effects
