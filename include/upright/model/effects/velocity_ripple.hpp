// velocity_ripple: a force that is periodic in the cart's velocity.
#pragma once

#include <cmath>

#include "upright/model/effect.hpp"
#include "upright/model/elementary.hpp"

namespace upright::effects {

/// A force that is periodic in the cart's velocity, as an amplifier with a faulty speed loop makes. It is
/// odd: the track looks the same in both directions.
struct VelocityRipple {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"amplitude_n", "N", Range::any(), 0.0, 0.1, "A: amplitude, positive if it drives the cart near rest"},
      {"period_mps", "m/s", Range::positive(), no_neutral, 0.1, "u: velocity from one crest to the next"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"velocity_ripple",
                                   Enters::cart,
                                   false,
                                   "F = A sin(2 pi v / u)",
                                   "a force that repeats with the velocity: a faulty speed loop",
                                   parameters};

  /// Force on the cart [N].
  template <class S>
  static S cart_force(const S* p, const S& /*x*/, const S& v) {
    return p[0] * elementary::sin(two_pi * v / p[1]);
  }

  /// Its greatest rate [1/s].
  static double rate_radps(const double* p, double /*v*/, double mass) {
    return two_pi * std::abs(p[0]) / (p[1] * mass);
  }

 private:
  static constexpr double two_pi = 6.283185307179586;
};

}  // namespace upright::effects
