// input_delay: delay between the command and the voltage.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// Delay between the command and the voltage.
struct InputDelay {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"delay_s", "s", (Range{0.0, 1.0}), 0.0, 0.005, "d: the delay"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "input_delay", Enters::actuator, false, "V(t) -> V(t - d)", "the voltage acts later than commanded",
      parameters};

  /// Delay of the input [s].
  template <class S>
  static S input_delay_s(const S* p) {
    return p[0];
  }
};

}  // namespace upright::effects
