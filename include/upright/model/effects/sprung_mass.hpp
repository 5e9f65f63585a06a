// sprung_mass: a mass that hangs on the cart by a spring: a cable chain, a loose cover.
#pragma once

#include <cmath>

#include "upright/model/effect.hpp"

namespace upright::effects {

/// A mass that hangs on the cart by a spring with a damper, and moves along the track. Slow motions carry it
/// with the cart, fast ones leave it behind.
struct SprungMass {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"sprung_mass_kg", "kg", Range::not_negative(), 0.0, 0.1, "m: in addition to the cart's own mass"},
      {"frequency_hz", "Hz", Range::positive(), no_neutral, 5.0, "f: at which it swings on a cart at rest"},
      {"damping_ratio", "1", Range::not_negative(), no_neutral, 0.05, "d: 1 is critical damping"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "sprung_mass",
      Enters::cart,
      false,
      "w = 2 pi f; F = m (w^2 q + 2 d w dq/dt); d2q/dt2 = -F / m - a, q from the "
      "cart to the mass, a the cart's acceleration",
      "a mass that hangs on the cart by a spring: a cable chain, a loose cover",
      parameters};

  /// The cart's mass does not contain it.
  static constexpr bool motor_is_attached = false;

  /// Mass [kg].
  template <class S>
  static S attached_mass_kg(const S* p, const S& /*cart_mass_kg*/) {
    return p[0];
  }

  /// Acceleration by which its spring and damper pull it back to the cart [m/s^2].
  template <class S, class T>
  static T attached_pull_mps2(const S* p, const S& /*mass_kg*/, const T& q, const T& rate) {
    const S w = two_pi * p[1];
    return w * (w * q + (2.0 * p[2]) * rate);
  }

  /// Its greatest rate [1/s], on a cart of this mass that moves freely.
  static double rate_radps(const double* p, double /*v*/, double mass) {
    const double w = two_pi * p[1], both = 1.0 + p[0] / mass;
    return w * std::sqrt(both) + 2.0 * p[2] * w * both;
  }

 private:
  static constexpr double two_pi = 6.283185307179586;
};

}  // namespace upright::effects
