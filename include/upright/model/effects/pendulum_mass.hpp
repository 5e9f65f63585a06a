// pendulum_mass: the pendulum's mass is larger or smaller than in the model.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// The pendulum's mass is larger or smaller than in the model.
struct PendulumMass {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"scale", "1", Range::positive(), 1.0, 1.0, "k: true mass over the mass in the model"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"pendulum_mass",
                                   Enters::parameter,
                                   false,
                                   "m -> k m, J -> k J",
                                   "the pendulum is heavier or lighter than the model says",
                                   parameters};

  /// Applies it to the base parameters.
  template <class S>
  static void correct(const S* p, BaseParameters<S>& base) {
    base.pendulum_mass_kg = p[0] * base.pendulum_mass_kg;
    base.inertia_about_pivot_kgm2 = p[0] * base.inertia_about_pivot_kgm2;
  }
};

}  // namespace upright::effects
