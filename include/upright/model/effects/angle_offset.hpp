// angle_offset: the zero of the angle sensor deviates from the vertical.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// The zero of the angle sensor deviates from the vertical.
struct AngleOffset {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"offset_rad", "rad", Range::any(), 0.0, 0.01, "o: what the sensor shows upright"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"angle_offset",
                                   Enters::sensor,
                                   false,
                                   "measured theta = theta + o",
                                   "the angle sensor is zeroed off the vertical",
                                   parameters};

  /// Its place among the sensors.
  static constexpr int sensor_stage = 2;

  /// Applies it to the outputs of the sensors.
  template <class S>
  static void measure(const S* p, Outputs<S>& outputs) {
    outputs.theta_rad = outputs.theta_rad + p[0];
  }
};

}  // namespace upright::effects
