// cart_mass: the cart's mass is larger or smaller than in the model.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// The cart's mass is larger or smaller than in the model.
struct CartMass {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"scale", "1", Range::positive(), 1.0, 1.0, "k: true mass over the mass in the model"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "cart_mass", Enters::parameter, false, "M -> k M", "the cart is heavier or lighter than the model says",
      parameters};

  /// Applies it to the base parameters.
  template <class S>
  static void correct(const S* p, BaseParameters<S>& base) {
    base.cart_mass_kg = p[0] * base.cart_mass_kg;
  }
};

}  // namespace upright::effects
