// position_dependent_friction: dry friction whose level varies linearly along the track.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// Dry friction whose level varies linearly along the track.
struct PositionDependentFriction {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"slope_n_per_m", "N/m", Range::any(), 0.0, 0.5, "s: growth of the level per metre toward +x"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"position_dependent_friction",
                                   Enters::cart,
                                   true,
                                   "L += s x",
                                   "dry friction that changes along the track",
                                   parameters};

  /// Its share of the dry level [N].
  template <class S>
  static S cart_dry_level(const S* p, const S& x, const S& /*speed*/, const S& /*direction*/) {
    return p[0] * x;
  }
};

}  // namespace upright::effects
