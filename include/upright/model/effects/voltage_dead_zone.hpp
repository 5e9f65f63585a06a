// voltage_dead_zone: voltages within the dead zone have no effect.
#pragma once

#include "upright/model/effect.hpp"
#include "upright/model/scalar.hpp"

namespace upright::effects {

/// Voltages within the dead zone have no effect.
struct VoltageDeadZone {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"half_width_v", "V", Range::not_negative(), 0.0, 0.3, "w: half of the zone"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "voltage_dead_zone",         Enters::actuator, false, "V -> V - sgn(V) w outside +-w, 0 inside",
      "small voltages do nothing", parameters};

  /// Its place in the actuator chain.
  static constexpr int actuator_stage = 1;

  /// The voltage after this stage [V].
  template <class S>
  static S actuate(const S* p, const S& volts) {
    return select(volts > p[0], S(volts - p[0]), select(volts < -p[0], S(volts + p[0]), S(0.0)));
  }
};

}  // namespace upright::effects
