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

  /// Whether it is analytic from the speed 0 on.
  static bool has_short_series(const double* p) { return p[2] == 2.0; }

  /// By how much the speed may change in a step of a millisecond by a Taylor series of order 4 [m/s]. The
  /// first derivative left out, the fourth, is largest at rest: 12 Fe / vs^4. A step leaves an error of the
  /// speed of 1/5 ms Fe / mass 12 / 24 (change / vs)^4.
  template <class P>
  static P longest_sweep_mps(const P* p, const P& mass_kg) {
    using std::sqrt;
    constexpr double error_mps = 2e-7, step_s = 1e-3, smallest_n = 1e-9;
    const P least(smallest_n);
    return p[1] * sqrt(P(sqrt(P(P(10.0 * error_mps / step_s) * mass_kg / (p[0] + least)))));
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
