// friction_asymmetry: dry friction whose level depends on the direction.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// Dry friction whose level depends on the direction.
struct FrictionAsymmetry {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"force_n", "N", Range::any(), 0.0, 0.2,
       "d: added to the level when the cart moves toward +x, taken off the other way"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"friction_asymmetry",
                                   Enters::cart,
                                   true,
                                   "L += d s, s = sgn(v)",
                                   "dry friction that is larger one way than the other",
                                   parameters};

  /// Its share of the dry level [N].
  template <class S>
  static S cart_dry_level(const S* p, const S& /*x*/, const S& /*speed*/, const S& direction) {
    return p[0] * direction;
  }
};

}  // namespace upright::effects
