// cable_spring: the force of a cable or spring toward a position on the track.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// The force of a cable or spring toward a position on the track.
struct CableSpring {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"stiffness_n_per_m", "N/m", Range::not_negative(), 0.0, 2.0, "k: stiffness"},
      {"center_m", "m", Range::any(), no_neutral, 0.0, "x0: where it does not pull"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"cable_spring",
                                   Enters::cart,
                                   false,
                                   "F = -k (x - x0)",
                                   "the pull of a cable or a spring toward a place on the track",
                                   parameters};

  /// Force on the cart [N].
  template <class S>
  static S cart_force(const S* p, const S& x, const S& /*v*/) {
    return -p[0] * (x - p[1]);
  }
};

}  // namespace upright::effects
