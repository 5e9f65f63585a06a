// pivot_coulomb_friction: dry friction in the pivot.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// Dry friction in the pivot.
struct PivotCoulombFriction {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"torque_nm", "N m", Range::not_negative(), 0.0, 0.003, "t: the level"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "pivot_coulomb_friction",    Enters::pendulum, true, "T = -t sgn(w); at rest: holds up to t",
      "dry friction in the pivot", parameters};

  /// Dry level of the pivot [N m].
  template <class S>
  static S pivot_dry_level(const S* p) {
    return p[0];
  }
};

}  // namespace upright::effects
