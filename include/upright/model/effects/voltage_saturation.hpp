// voltage_saturation: limit of the amplifier's voltage in both directions.
#pragma once

#include "upright/model/effect.hpp"
#include "upright/model/scalar.hpp"

namespace upright::effects {

/// Limit of the amplifier's voltage in both directions.
struct VoltageSaturation {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"limit_v", "V", Range::positive(), std::numeric_limits<double>::infinity(), 10.0, "w: the limit"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"voltage_saturation",
                                   Enters::actuator,
                                   false,
                                   "V -> max(-w, min(w, V))",
                                   "the amplifier gives no more than a limit, either way",
                                   parameters};

  /// Its place in the actuator chain.
  static constexpr int actuator_stage = 4;

  /// The voltage after this stage [V].
  template <class S>
  static S actuate(const S* p, const S& volts) {
    return select(volts > p[0], p[0], select(volts < -p[0], S(-p[0]), volts));
  }
};

}  // namespace upright::effects
