// voltage_saturation: limit of the amplifier's voltage in both directions.
#pragma once

#include "upright/model/effect.hpp"
#include "upright/model/scalar.hpp"

namespace upright::effects {

struct VoltageSaturation {
  static constexpr ParameterInfo parameters[] = {
      {"limit_v", "V", Range::positive(), std::numeric_limits<double>::infinity(), 10.0, "w: the limit"},
  };
  static constexpr EffectInfo info{"voltage_saturation",
                                   Enters::actuator,
                                   false,
                                   "V -> max(-w, min(w, V))",
                                   "the amplifier gives no more than a limit, either way",
                                   parameters};

  static constexpr int actuator_stage = 4;

  template <class S>
  static S actuate(const S* p, const S& volts) {
    return select(volts > p[0], p[0], select(volts < -p[0], S(-p[0]), volts));
  }
};

}  // namespace upright::effects
