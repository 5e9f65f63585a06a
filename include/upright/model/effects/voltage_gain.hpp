// voltage_gain: scale error of the amplifier.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

struct VoltageGain {
  static constexpr ParameterInfo parameters[] = {
      {"scale", "1", Range::positive(), 1.0, 1.0, "k: volts given per volt commanded"},
  };
  static constexpr EffectInfo info{"voltage_gain",
                                   Enters::actuator,
                                   false,
                                   "V -> k V",
                                   "the amplifier gives more or less than commanded, in proportion",
                                   parameters};

  static constexpr int actuator_stage = 2;

  template <class S>
  static S actuate(const S* p, const S& volts) {
    return p[0] * volts;
  }
};

}  // namespace upright::effects
