// drive_compliance: the drive gives way between the cart and its encoder, which sits on the motor's side. Its
// own motion is over between two samples. What is fed back without a sampled loop (a linear plant, the
// continuous loops) takes the drive as stiff, for there it would be a loop without delay.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

struct DriveCompliance {
  static constexpr ParameterInfo parameters[] = {
      {"compliance_m_per_n", "m/N", Range::not_negative(), 0.0, 1e-5,
       "c: how far the motor is ahead of the cart per force"},
  };
  static constexpr EffectInfo info{
      "drive_compliance",
      Enters::sensor,
      false,
      "measured x = x + c F, F the motor's force",
      "the drive gives way between the cart and its encoder, which sits on the motor's side",
      parameters};

  template <class S>
  static S drive_yields_m(const S* p, const S& motor_force) {
    return p[0] * motor_force;
  }
};

}  // namespace upright::effects
