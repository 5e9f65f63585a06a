// drive_compliance: elastic deflection of the drive between the cart and its encoder (on the motor's
// side). It is quasi-static: it settles between two samples. Unsampled loops (linear plants, the
// continuous loops) treat the drive as rigid, because it would form a feedback loop without delay.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// Elastic deflection of the drive between the cart and its encoder (on the motor's side). It is
/// quasi-static: it settles between two samples. Unsampled loops (linear plants, the continuous loops) treat
/// the drive as rigid, because it would form a feedback loop without delay.
struct DriveCompliance {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"compliance_m_per_n", "m/N", Range::not_negative(), 0.0, 1e-5,
       "c: how far the motor is ahead of the cart per force"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "drive_compliance",
      Enters::sensor,
      false,
      "measured x = x + c F, F the motor's force",
      "the drive gives way between the cart and its encoder, which sits on the motor's side",
      parameters};

  /// Position of the motor relative to the cart [m].
  template <class S>
  static S drive_deflection_m(const S* p, const S& motor_force) {
    return p[0] * motor_force;
  }
};

}  // namespace upright::effects
