// voltage_offset: a constant voltage that the amplifier adds, also at zero command.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// A constant voltage that the amplifier adds, also at zero command.
struct VoltageOffset {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"offset_v", "V", Range::any(), 0.0, 0.2, "b: the voltage at zero command"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"voltage_offset",
                                   Enters::actuator,
                                   false,
                                   "V -> V + b",
                                   "the amplifier adds a steady voltage, at zero command too",
                                   parameters};

  /// Its place in the actuator chain.
  static constexpr int actuator_stage = 3;

  /// The voltage after this stage [V].
  template <class S>
  static S actuate(const S* p, const S& volts) {
    return volts + p[0];
  }
};

}  // namespace upright::effects
