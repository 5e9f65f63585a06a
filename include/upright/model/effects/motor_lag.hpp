// motor_lag: first-order lag of the motor force behind the voltage; the back-EMF has no lag.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

struct MotorLag {
  static constexpr ParameterInfo parameters[] = {
      {"time_constant_s", "s", (Range{0.0, 10.0, true}), 0.0, 0.01, "T: time constant"},
  };
  static constexpr EffectInfo info{
      "motor_lag",
      Enters::actuator,
      false,
      "T du/dt = V - u",
      "the motor force follows the voltage with a first-order lag; back-EMF acts unlagged",
      parameters};

  template <class S>
  static S motor_time_constant_s(const S* p) {
    return p[0];
  }
};

}  // namespace upright::effects
