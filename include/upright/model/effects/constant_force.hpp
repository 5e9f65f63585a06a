// constant_force: a constant force on the cart, for example from a tilted track.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// A constant force on the cart, for example from a tilted track.
struct ConstantForce {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"force_n", "N", Range::any(), 0.0, 0.3, "f: positive toward +x"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "constant_force", Enters::cart, false, "F = f", "a steady force on the cart: a tilted track, a bias",
      parameters};

  /// Force on the cart [N].
  template <class S>
  static S cart_force(const S* p, const S& /*x*/, const S& /*v*/) {
    return p[0];
  }
};

}  // namespace upright::effects
