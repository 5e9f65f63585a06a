// backlash: play between the motor and the cart.
#pragma once

#include <cmath>

#include "upright/model/effect.hpp"
#include "upright/model/scalar.hpp"

namespace upright::effects {

/// Play between the motor and the cart, whose encoder runs with the cart. The motor's inertia crosses the gap
/// and meets a flank. Its contact is the one of Hunt and Crossley, "Coefficient of restitution interpreted as
/// damping in vibroimpact", J. Appl. Mech. 42 (1975): damping in proportion to the depth, so that the force
/// has no jump.
struct Backlash {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"gap_m", "m", Range::not_negative(), no_neutral, 2e-4,
       "g: free travel of the motor from flank to flank"},
      {"motor_share", "1", (Range{0.01, 0.9}), no_neutral, 0.2,
       "b: what of the cart's mass turns with the motor"},
      {"stiffness_n_per_m", "N/m", Range::positive(), no_neutral, 1e5, "k: of a flank"},
      {"damping_s_per_m", "s/m", Range::not_negative(), no_neutral, 10.0,
       "c: of a flank; the motor bounces back slower than 1 / c"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "backlash",
      Enters::actuator,
      false,
      "F = k d (1 + c dd/dt), not below 0, d = |q| - g/2 the depth in a flank, q from the cart to the motor; "
      "b M d2q/dt2 = F_motor - F - b M a; F acts on the cart, whose acceleration is a and mass (1 - b) M",
      "play between the motor and the cart, across which the motor's inertia moves freely",
      parameters};

  /// The motor is the mass, and its force acts on it.
  static constexpr bool motor_is_attached = true;

  /// Mass of the motor, as the cart feels it [kg].
  template <class S>
  static S attached_mass_kg(const S* p, const S& cart_mass_kg) {
    return p[1] * cart_mass_kg;
  }

  /// Acceleration by which a flank pushes it back [m/s^2].
  template <class S, class T>
  static T attached_pull_mps2(const S* p, const S& mass_kg, const T& q, const T& rate) {
    const T side = select(q < T(0.0), T(-1.0), T(1.0));
    const T depth_m = positive_part(T(side * q - 0.5 * p[0]));
    const T damping = positive_part(T(1.0 + p[3] * (side * rate)));
    return side * (p[2] / mass_kg) * depth_m * damping;
  }

  /// Its greatest rate [1/s], on a cart whose own mass this is: twice that of the contact, since steps cross
  /// the edge of a flank, where the force has a kink.
  static double rate_radps(const double* p, double /*v*/, double mass) {
    const double motor_kg = mass * p[1] / (1.0 - p[1]);
    return 2.0 * std::sqrt(p[2] * (1.0 / motor_kg + 1.0 / mass));
  }
};

}  // namespace upright::effects
