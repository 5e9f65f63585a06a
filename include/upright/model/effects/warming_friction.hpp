// warming_friction: dry friction that is larger, or smaller, when a run begins, and approaches its usual
// level.
#pragma once

#include "upright/model/effect.hpp"
#include "upright/model/elementary.hpp"

namespace upright::effects {

/// Dry friction that is larger, or smaller, when a run begins, and approaches its usual level. Computations
/// without a time (gains, margins) use the usual level.
struct WarmingFriction {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"force_n", "N", Range::any(), 0.0, 0.3, "F: by how much the level is larger when the run begins"},
      {"time_constant_s", "s", Range::positive(), no_neutral, 10.0, "T: how fast the difference decays"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"warming_friction",
                                   Enters::cart,
                                   true,
                                   "L += F exp(-t / T), t since the start of the run",
                                   "dry friction that changes while the rig warms up or the grease spreads",
                                   parameters};

  /// Its share of the dry level [N], a time after the start of the run.
  template <class S>
  static S cart_dry_level_after(const S* p, double since_start_s) {
    return p[0] * elementary::exp(S(-since_start_s / p[1]));
  }
};

}  // namespace upright::effects
