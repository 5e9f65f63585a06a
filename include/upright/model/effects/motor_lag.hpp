// motor_lag: first-order lag of the motor force behind the voltage; the back-EMF has no lag.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// First-order lag of the motor force behind the voltage; the back-EMF has no lag.
struct MotorLag {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"time_constant_s", "s", (Range{0.0, 10.0, true}), 0.0, 0.01, "T: time constant"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "motor_lag",
      Enters::actuator,
      false,
      "T du/dt = V - u",
      "the motor force follows the voltage with a first-order lag; back-EMF acts unlagged",
      parameters};

  /// Time constant of the motor lag [s].
  template <class S>
  static S motor_time_constant_s(const S* p) {
    return p[0];
  }
};

}  // namespace upright::effects
