// cart_scale: scale error of the cart encoder.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// Scale error of the cart encoder.
struct CartScale {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"scale", "1", Range::positive(), 1.0, 1.0, "k: metres shown per metre"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"cart_scale",
                                   Enters::sensor,
                                   false,
                                   "measured x = k x",
                                   "the cart encoder counts more or fewer metres than there are",
                                   parameters};

  /// Its place among the sensors.
  static constexpr int sensor_stage = 1;

  /// Applies it to the outputs of the sensors.
  template <class S>
  static void measure(const S* p, Outputs<S>& outputs) {
    outputs.cart_m = p[0] * outputs.cart_m;
  }
};

}  // namespace upright::effects
