// coulomb_friction: dry friction between cart and track with a level independent of speed.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// Dry friction between cart and track with a level independent of speed.
struct CoulombFriction {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"force_n", "N", Range::not_negative(), 0.0, 0.5,
       "Fc: sliding level, and the breakaway level where there is no Stribeck excess"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "coulomb_friction",
      Enters::cart,
      true,
      "level L = Fc; sliding: F = -L sgn(v); at rest: holds up to L",
      "dry friction between cart and track with a level that does not depend on speed",
      parameters};

  /// Its share of the dry level [N].
  template <class P, class S>
  static S cart_dry_level(const P* p, const S& /*x*/, const S& /*speed*/, const S& /*direction*/) {
    return p[0];
  }
};

}  // namespace upright::effects
