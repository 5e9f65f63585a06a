// An effect of one's own: a magnet on the cart over a conducting track, whose drag falls again beyond a
// speed. include/upright/model/effect.hpp describes what an effect may define.
#pragma once

#include <tuple>

#include "upright/model/effect.hpp"

namespace upright {

namespace effects {

struct EddyCurrentBrake {
  static constexpr ParameterInfo parameters[] = {
      {"coefficient_n_per_mps", "N s/m", Range::not_negative(), 0.0, 1.0, "c: force per velocity near rest"},
      {"critical_mps", "m/s", Range::positive(), no_neutral, 1.0, "vc: where the drag is largest"},
  };
  static constexpr EffectInfo info{"eddy_current_brake",
                                   Enters::cart,
                                   false,
                                   "F = -c v / (1 + (v/vc)^2)",
                                   "a magnet over a conducting track, whose drag falls again beyond a speed",
                                   parameters};

  template <class S>
  static S cart_force(const S* p, const S& /*x*/, const S& v) {
    const S ratio = v / p[1];
    return -p[0] * v / (S(1.0) + ratio * ratio);
  }
};

}  // namespace effects

/// What upright adds to its own effects.
using ExtraEffects = std::tuple<effects::EddyCurrentBrake>;

}  // namespace upright
