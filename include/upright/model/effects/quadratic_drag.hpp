// quadratic_drag: drag on the cart, proportional to the square of its velocity.
#pragma once

#include "upright/model/effect.hpp"
#include "upright/model/scalar.hpp"

namespace upright::effects {

/// Drag on the cart, proportional to the square of its velocity.
struct QuadraticDrag {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"coefficient_n_per_mps2", "N s^2/m^2", Range::not_negative(), 0.0, 1.0,
       "c: force per velocity squared"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"quadratic_drag",
                                   Enters::cart,
                                   false,
                                   "F = -c v |v|",
                                   "drag on the cart with the square of its velocity",
                                   parameters};

  /// Its force is not smooth at zero velocity.
  static constexpr bool kink_at_cart_rest = true;

  /// Force on the cart [N].
  template <class S>
  static S cart_force(const S* p, const S& /*x*/, const S& v) {
    return -p[0] * v * absolute(v);
  }
};

}  // namespace upright::effects
