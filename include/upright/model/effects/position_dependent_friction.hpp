// position_dependent_friction: dry friction whose level varies linearly along the track.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

struct PositionDependentFriction {
  static constexpr ParameterInfo parameters[] = {
      {"slope_n_per_m", "N/m", Range::any(), 0.0, 0.5, "s: growth of the level per metre toward +x"},
  };
  static constexpr EffectInfo info{"position_dependent_friction",
                                   Enters::cart,
                                   true,
                                   "L += s x",
                                   "dry friction that changes along the track",
                                   parameters};

  template <class S>
  static S cart_dry_level(const S* p, const S& x, const S& /*speed*/, const S& /*direction*/) {
    return p[0] * x;
  }
};

}  // namespace upright::effects
