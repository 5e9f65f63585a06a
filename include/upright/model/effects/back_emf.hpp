// back_emf: the motor's back-EMF is larger or smaller than in the model.
#pragma once

#include "upright/model/effect.hpp"

namespace upright::effects {

struct BackEmf {
  static constexpr ParameterInfo parameters[] = {
      {"scale", "1", Range::positive(), 1.0, 1.0, "k: true back-EMF force over the model's"},
  };
  static constexpr EffectInfo info{"back_emf",
                                   Enters::parameter,
                                   false,
                                   "beta -> k beta",
                                   "the motor brakes more or less than the model says",
                                   parameters};

  template <class S>
  static void correct(const S* p, BaseParameters<S>& base) {
    base.back_emf_n_per_mps = p[0] * base.back_emf_n_per_mps;
  }
};

}  // namespace upright::effects
