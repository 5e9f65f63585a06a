// pivot_coulomb_friction: dry friction in the pivot.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

struct PivotCoulombFriction {
  static constexpr ParameterInfo parameters[] = {
      {"torque_nm", "N m", Range::not_negative(), 0.0, 0.003, "t: the level"},
  };
  static constexpr EffectInfo info{
      "pivot_coulomb_friction",    Enters::pendulum, true, "T = -t sgn(w); at rest: holds up to t",
      "dry friction in the pivot", parameters};

  template <class S>
  static S pivot_dry_level(const S* p) {
    return p[0];
  }
};

}  // namespace upright::effects
