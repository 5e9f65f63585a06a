// back_emf: the motor's back-EMF is larger or smaller than in the model.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

/// The motor's back-EMF is larger or smaller than in the model.
struct BackEmf {
  /// Its parameters, in the order of a plant file.
  static constexpr ParameterInfo parameters[] = {
      {"scale", "1", Range::positive(), 1.0, 1.0, "k: true back-EMF force over the model's"},
  };
  /// Its entry in the registry.
  static constexpr EffectInfo info{"back_emf",
                                   Enters::parameter,
                                   false,
                                   "beta -> k beta",
                                   "the motor brakes more or less than the model says",
                                   parameters};

  /// Applies it to the base parameters.
  template <class S>
  static void correct(const S* p, BaseParameters<S>& base) {
    base.back_emf_n_per_mps = p[0] * base.back_emf_n_per_mps;
  }
};

}  // namespace upright::effects
