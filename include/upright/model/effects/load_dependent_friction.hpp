// load_dependent_friction: dry friction that grows with the force that the drive transmits.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// Dry friction that grows with the force that the drive transmits, as that of loaded gear teeth.
struct LoadDependentFriction {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"coefficient", "1", (Range{0.0, 0.95}), 0.0, 0.1, "mu: friction per force of the motor"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"load_dependent_friction",
                                   Enters::cart,
                                   true,
                                   "L += mu |F|, F the motor's force",
                                   "dry friction that grows with the force on gear teeth or spindle",
                                   parameters};

  /// Its share of the dry level [N] under a force of the motor of this size.
  template <class S>
  static S cart_dry_level_under(const S* p, const S& motor_n) {
    return p[0] * motor_n;
  }
};

}  // namespace upright::effects
