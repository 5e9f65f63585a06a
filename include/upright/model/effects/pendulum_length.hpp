// pendulum_length: the pendulum is longer or shorter than in the model.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// The pendulum is longer or shorter than in the model.
struct PendulumLength {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"scale", "1", Range::positive(), 1.0, 1.0, "k: true length over the length in the model"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"pendulum_length",
                                   Enters::parameter,
                                   false,
                                   "l -> k l, J -> k^2 J",
                                   "the pendulum is longer or shorter than the model says",
                                   parameters};

  /// Applies it to the base parameters.
  template <class S>
  static void correct(const S* p, BaseParameters<S>& base) {
    base.length_to_com_m = p[0] * base.length_to_com_m;
    base.inertia_about_pivot_kgm2 = p[0] * p[0] * base.inertia_about_pivot_kgm2;
  }
};

}  // namespace upright::effects
