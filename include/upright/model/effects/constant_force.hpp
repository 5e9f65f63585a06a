// constant_force: a constant force on the cart, for example from a tilted track.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

struct ConstantForce {
  static constexpr ParameterInfo parameters[] = {
      {"force_n", "N", Range::any(), 0.0, 0.3, "f: positive toward +x"},
  };
  static constexpr EffectInfo info{
      "constant_force", Enters::cart, false, "F = f", "a steady force on the cart: a tilted track, a bias",
      parameters};

  template <class S>
  static S cart_force(const S* p, const S& /*x*/, const S& /*v*/) {
    return p[0];
  }
};

}  // namespace upright::effects
