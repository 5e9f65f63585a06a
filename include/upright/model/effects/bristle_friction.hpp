// bristle_friction: represents the dry friction by elastic bristles instead of rigid sticking (paper,
// equations (8) and (9)).
#pragma once

#include <cmath>

#include "upright/model/effect.hpp"

namespace upright::effects {

/// Represents the dry friction by elastic bristles instead of rigid sticking (paper, equations (8) and (9)).
struct BristleFriction {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"stiffness_n_per_m", "N/m", Range::positive(), no_neutral, 121.0, "s0: stiffness of the bristles"},
      {"damping_n_per_mps", "N s/m", Range::not_negative(), no_neutral, 70.0, "s1: damping of the bristles"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"bristle_friction",
                                   Enters::cart,
                                   false,
                                   "dz/dt = v - s0 |v| z / L(v); F = -s0 z - s1 dz/dt",
                                   "renders the dry level through elastic bristles instead of rigid sticking "
                                   "(paper, equations (8) and (9))",
                                   parameters};

  /// Its force is not smooth at zero velocity.
  static constexpr bool kink_at_cart_rest = true;

  /// Stiffness of the bristles [N/m].
  template <class S>
  static S bristle_stiffness(const S* p) {
    return p[0];
  }

  /// Damping of the bristles [N s/m].
  template <class S>
  static S bristle_damping(const S* p) {
    return p[1];
  }

  /// Its greatest rate [1/s].
  static double rate_radps(const double* p, double /*v*/, double mass) {
    return p[1] / mass + std::sqrt(p[0] / mass);
  }
};

}  // namespace upright::effects
