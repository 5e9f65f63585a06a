// voltage_gain: scale error of the amplifier.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// Scale error of the amplifier.
struct VoltageGain {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"scale", "1", Range::positive(), 1.0, 1.0, "k: volts given per volt commanded"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"voltage_gain",
                                   Enters::actuator,
                                   false,
                                   "V -> k V",
                                   "the amplifier gives more or less than commanded, in proportion",
                                   parameters};

  /// Its place in the actuator chain.
  static constexpr int actuator_stage = 2;

  /// The voltage after this stage [V].
  template <class S>
  static S actuate(const S* p, const S& volts) {
    return p[0] * volts;
  }
};

}  // namespace upright::effects
