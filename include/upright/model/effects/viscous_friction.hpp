// viscous_friction: friction on the cart, proportional to its velocity.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// Friction on the cart, proportional to its velocity.
struct ViscousFriction {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"coefficient_n_per_mps", "N s/m", Range::not_negative(), 0.0, 3.0, "c: force per velocity"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"viscous_friction",
                                   Enters::cart,
                                   false,
                                   "F = -c v",
                                   "friction on the cart in proportion to its velocity",
                                   parameters};

  /// Force on the cart [N].
  template <class P, class S>
  static S cart_force(const P* p, const S& /*x*/, const S& v) {
    return -p[0] * v;
  }
};

}  // namespace upright::effects
