// stribeck_friction: dry friction with a higher level near rest; the breakaway level is Fc + Fe (paper,
// equation (5)).
#pragma once

#include <cmath>
#include <type_traits>

#include "upright/model/effect.hpp"
#include "upright/model/elementary.hpp"
#include "upright/model/scalar.hpp"

namespace upright::effects {

/// Dry friction with a higher level near rest; the breakaway level is Fc + Fe (paper, equation (5)).
struct StribeckFriction {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"extra_force_n", "N", Range::not_negative(), 0.0, 0.5, "Fe: by how much breakaway exceeds sliding"},
      {"velocity_mps", "m/s", Range::positive(), no_neutral, 0.1,
       "vs: Stribeck velocity, over which the excess decays"},
      {"shape", "1", (Range{0.1, 10.0}), no_neutral, 2.0, "form factor of the decay"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{
      "stribeck_friction",
      Enters::cart,
      true,
      "L += Fe exp(-|v/vs|^shape)",
      "dry friction that is larger near rest: the breakaway level is Fc + Fe (paper, equation (5))",
      parameters};

  /// Its share of the dry level [N]. Inlined, as lanes evaluate it several times at one speed.
  template <class P, class S>
  [[gnu::always_inline]] static S cart_dry_level(const P* p, const S& /*x*/, const S& speed,
                                                 const S& /*direction*/) {
    return p[0] * decay(S(speed / p[1]), p[2]);
  }

  /// Whether few terms of its Taylor series in time tell it over a millisecond, from the speed 0 on. A cart
  /// that accelerates by 10 m/s^2 gains a third of the smallest velocity then. With four terms, errors of 240
  /// random runs stayed below 2e-7 m above it and reached 2e-5 m below.
  static bool has_short_series(const double* p) {
    constexpr double slowest_mps = 0.03;
    return p[2] == 2.0 && p[1] >= slowest_mps;
  }

  /// Its greatest rate [1/s].
  static double rate_radps(const double* p, double v, double mass) {
    return std::abs(v) < 4.0 * p[1] ? p[0] / (p[1] * mass) : 0.0;
  }

 private:
  template <class P, class S>
  [[gnu::always_inline]] static S decay(const S& u, [[maybe_unused]] const P& shape) {
    if constexpr (!std::is_same_v<P, S>) {
      return elementary::exp(S(-(u * u)));  // series in time are of analytic friction only
    } else {
      if (is_plainly(shape, 2.0)) return elementary::exp(S(-(u * u)));
      if (is_plainly(shape, 1.0)) return elementary::exp(S(-u));
      if constexpr (std::is_same_v<S, double>) {
        return elementary::exp(-elementary::power(u, shape));
      } else {
        constexpr double smallest = 1e-12;  // keeps log finite at rest, where the excess is complete
        return elementary::exp(S(-elementary::exp(S(shape * elementary::log(S(u + S(smallest)))))));
      }
    }
  }
};

}  // namespace upright::effects
