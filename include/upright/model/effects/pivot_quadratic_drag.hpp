// pivot_quadratic_drag: air drag on the pendulum, proportional to the square of its rate.
#pragma once

#include "upright/model/effect.hpp"
#include "upright/model/scalar.hpp"

namespace upright::effects {

/// Air drag on the pendulum, proportional to the square of its rate.
struct PivotQuadraticDrag {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"coefficient_nms2_per_rad2", "N m s^2/rad^2", Range::not_negative(), 0.0, 0.0003,
       "c: torque per rate squared"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"pivot_quadratic_drag",
                                   Enters::pendulum,
                                   false,
                                   "T = -c w |w|",
                                   "drag on the pendulum with the square of its rate: the air",
                                   parameters};

  /// Its torque is not smooth at zero rate.
  static constexpr bool kink_at_pivot_rest = true;

  /// Torque about the pivot [N m].
  template <class S>
  static S pivot_torque(const S* p, const S& omega) {
    return -p[0] * omega * absolute(omega);
  }
};

}  // namespace upright::effects
