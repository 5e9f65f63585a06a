// flexible_rod: a rod of the pendulum that bends.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// A rod that bends, in the first mode of a slender uniform rod that is clamped to its pivot: a mass moves
/// across the rod. Centre of mass and inertia about the pivot remain those of the plant file. Of such a rod
/// of length L and mass m, 0.613 m at 0.7265 L vibrate (from the mode shape of a clamped-free beam: Blevins,
/// "Formulas for Natural Frequency and Mode Shape", 1979), which is a share of 0.97. The centre of
/// oscillation is at 2 L / 3. A mass there would not be excited by the cart.
struct FlexibleRod {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"vibrating_share", "1", (Range{0.0, 0.97}), 0.0, 0.3, "s: of the pendulum's inertia about the pivot"},
      {"frequency_hz", "Hz", Range::positive(), no_neutral, 10.0,
       "f: at which it vibrates while the pivot turns freely on a cart at rest"},
      {"damping_ratio", "1", Range::not_negative(), no_neutral, 0.02, "d: 1 is critical damping"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "flexible_rod",
      Enters::pendulum,
      false,
      "w = 2 pi f; p = (1 - s) (w^2 q + 2 d w dq/dt); d2q/dt2 = q dth/dt^2 - p + g sin(th) - a cos(th) - "
      "h d2th/dt2, q across the rod, a the cart's acceleration; mass s J / h^2 at h = 1.09 J / (m l)",
      "a rod of the pendulum that bends",
      parameters};

  /// Distance of the vibrating mass from the pivot, over that of the centre of oscillation.
  static constexpr double lever_over_oscillation = 0.7265 / (2.0 / 3.0);

  /// What of the pendulum's inertia about the pivot moves across the rod.
  template <class S>
  static S vibrating_share(const S* p) {
    return p[0];
  }

  /// Acceleration by which the rod pulls it back [m/s^2]. The rest of the pendulum yields, which makes the
  /// vibration faster by 1 / sqrt(1 - s).
  template <class S, class T>
  static T attached_pull_mps2(const S* p, const S& /*mass_kg*/, const T& q, const T& rate) {
    const S w = two_pi * p[1];
    return (1.0 - p[0]) * w * (w * q + (2.0 * p[2]) * rate);
  }

  /// Its greatest rate [1/s].
  static double rate_radps(const double* p, double /*v*/, double /*mass*/) {
    const double w = two_pi * p[1];
    return w + 2.0 * p[2] * w;
  }

 private:
  static constexpr double two_pi = 6.283185307179586;
};

}  // namespace upright::effects
