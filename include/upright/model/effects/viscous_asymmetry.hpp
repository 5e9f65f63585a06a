// viscous_asymmetry: viscous friction that depends on the direction.
#pragma once

#include "upright/model/effect.hpp"
#include "upright/model/scalar.hpp"

namespace upright::effects {

/// Viscous friction that depends on the direction.
struct ViscousAsymmetry {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"difference_n_per_mps", "N s/m", Range::any(), 0.0, 0.5,
       "d: the viscous coefficient is c + d toward +x and c - d the other way"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"viscous_asymmetry",
                                   Enters::cart,
                                   false,
                                   "F = -d |v|",
                                   "viscous friction that is larger one way than the other",
                                   parameters};

  /// Its force is not smooth at zero velocity.
  static constexpr bool kink_at_cart_rest = true;

  /// Force on the cart [N].
  template <class S>
  static S cart_force(const S* p, const S& /*x*/, const S& v) {
    return -p[0] * absolute(v);
  }
};

}  // namespace upright::effects
