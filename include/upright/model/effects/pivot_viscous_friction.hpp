// pivot_viscous_friction: friction in the pivot, proportional to the rate.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// Friction in the pivot, proportional to the rate.
struct PivotViscousFriction {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"coefficient_nms_per_rad", "N m s/rad", Range::not_negative(), 0.0, 0.001, "c: torque per rate"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"pivot_viscous_friction",
                                   Enters::pendulum,
                                   false,
                                   "T = -c w",
                                   "friction in the pivot in proportion to the rate",
                                   parameters};

  /// Torque about the pivot [N m].
  template <class S>
  static S pivot_torque(const S* p, const S& omega) {
    return -p[0] * omega;
  }
};

}  // namespace upright::effects
