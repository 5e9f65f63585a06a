// voltage_offset: a constant voltage that the amplifier adds, also at zero command.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

struct VoltageOffset {
  static constexpr ParameterInfo parameters[] = {
      {"offset_v", "V", Range::any(), 0.0, 0.2, "b: the voltage at zero command"},
  };
  static constexpr EffectInfo info{"voltage_offset",
                                   Enters::actuator,
                                   false,
                                   "V -> V + b",
                                   "the amplifier adds a steady voltage, at zero command too",
                                   parameters};

  static constexpr int actuator_stage = 3;

  template <class S>
  static S actuate(const S* p, const S& volts) {
    return volts + p[0];
  }
};

}  // namespace upright::effects
