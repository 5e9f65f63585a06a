// The mass with a motion of its own along the track that an effect attaches to the cart: a sprung mass, or
// the motor behind its backlash. A plant has one at most.
#pragma once

#include "upright/model/effect_hooks.hpp"
#include "upright/model/plant_model.hpp"

namespace upright {

/// The attached mass of one plant, for numbers S. `Present` as in Dynamics.
template <class S, class Present>
class AttachedMass {
 public:
  /// Of a plant whose cart has this mass, with the motor.
  AttachedMass(const PlantModel<S>& model, const Present& present, const S& cart_mass_kg) {
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if constexpr (may_attach<I>())
        if (present.template has<I>()) {
          exists_ = true;
          motor_ = E::motor_is_attached;
          mass_kg_ = E::attached_mass_kg(model.template of<I>(), cart_mass_kg);
        }
    });
  }

  bool exists() const { return may_exist() && exists_; }   ///< whether the plant has one
  bool is_motor() const { return may_exist() && motor_; }  ///< whether it is a part of the cart's mass
  const S& mass_kg() const { return mass_kg_; }            ///< 0: none

  /// Acceleration by which it is pulled back to the cart, from q at this rate [m/s^2].
  template <class T>
  T pull_mps2(const PlantModel<S>& model, const T& q, const T& rate) const {
    T pull(0.0);
    for_each_effect([&]<std::size_t I>() {
      if constexpr (may_attach<I>())
        if (model.present.template has<I>())
          pull = EffectAt<I>::attached_pull_mps2(model.template of<I>(), mass_kg_, q, rate);
    });
    return pull;
  }

 private:
  template <std::size_t I>
  static constexpr bool may_attach() {
    return has_attached_mass<EffectAt<I>, S> && Present::template may_have<I>();
  }
  /// Known at compile time where the effects are.
  static constexpr bool may_exist() {
    bool may = false;
    for_each_effect([&]<std::size_t I>() { may = may || may_attach<I>(); });
    return may;
  }

  bool exists_ = false, motor_ = false;
  S mass_kg_{0.0};
};

}  // namespace upright
