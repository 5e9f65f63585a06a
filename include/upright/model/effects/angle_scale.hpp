// angle_scale: scale error of the angle encoder about the upright position.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// Scale error of the angle encoder about the upright position.
struct AngleScale {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"scale", "1", Range::positive(), 1.0, 1.0, "k: radians shown per radian"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "angle_scale",
      Enters::sensor,
      false,
      "measured theta = k theta",
      "the angle encoder counts more or fewer radians than there are; zero is upright",
      parameters};

  /// Its place among the sensors.
  static constexpr int sensor_stage = 1;

  /// Applies it to the outputs of the sensors.
  template <class S>
  static void measure(const S* p, Outputs<S>& outputs) {
    outputs.theta_rad = p[0] * outputs.theta_rad;
  }
};

}  // namespace upright::effects
