// stribeck_friction: dry friction that is larger near rest: the breakaway level is Fc + Fe (paper, equation
// (5)).
#pragma once

#include <cmath>

#include "upright/model/effect.hpp"

namespace upright::effects {

struct StribeckFriction {
  static constexpr ParameterInfo parameters[] = {
      {"extra_force_n", "N", Range::not_negative(), 0.0, 0.5, "Fe: by how much breakaway exceeds sliding"},
      {"velocity_mps", "m/s", Range::positive(), no_neutral, 0.1,
       "vs: Stribeck velocity, over which the excess decays"},
      {"shape", "1", (Range{0.1, 10.0}), no_neutral, 2.0, "form factor of the decay"},
  };
  static constexpr EffectInfo info{
      "stribeck_friction",
      Enters::cart,
      true,
      "L += Fe exp(-|v/vs|^shape)",
      "dry friction that is larger near rest: the breakaway level is Fc + Fe (paper, equation (5))",
      parameters};

  template <class S>
  static S cart_dry_level(const S* p, const S& /*x*/, const S& speed, const S& /*direction*/) {
    return p[0] * decay(S(speed / p[1]), p[2]);
  }

  static double rate_radps(const double* p, double v, double mass) {
    return std::abs(v) < 4.0 * p[1] ? p[0] / (p[1] * mass) : 0.0;
  }

 private:
  template <class S>
  static S decay(const S& u, const S& shape) {
    using std::exp;
    using std::log;
    constexpr double smallest = 1e-12;  // keeps log finite at rest, where the excess is whole anyway
    return exp(-exp(shape * log(u + S(smallest))));
  }

  static double decay(double u, double shape) {
    if (shape == 2.0) return std::exp(-u * u);
    if (shape == 1.0) return std::exp(-u);
    return std::exp(-std::pow(u, shape));
  }
};

}  // namespace upright::effects
