// The mass with a motion of its own that an effect attaches to the plant. On the cart it moves along the
// track: a sprung mass, or the motor behind its backlash. On the rod of the pendulum it moves across the rod,
// which bends. A plant has one at most.
#pragma once

#include "upright/model/effect_hooks.hpp"
#include "upright/model/elementary.hpp"
#include "upright/model/motion_equations.hpp"
#include "upright/model/plant_model.hpp"
#include "upright/model/plant_state.hpp"

namespace upright {

/// The attached mass of one plant, for numbers S. `Present` as in Dynamics.
template <class S, class Present>
class AttachedMass {
 public:
  /// `base`: after the effects that correct it; the mass of the cart with the motor.
  AttachedMass(const PlantModel<S>& model, const Present& present, const BaseParameters<S>& base) {
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if constexpr (may_attach<I>())
        if (present.template has<I>()) attach<E>(model.template of<I>(), base);
    });
  }

  bool exists() const { return may_exist() && place_ != Place::nowhere; }  ///< whether the plant has one
  bool is_motor() const { return may_exist() && place_ == Place::motor; }  ///< a part of the cart's mass
  bool is_on_rod() const { return may_exist() && place_ == Place::rod; }   ///< a part of the pendulum
  const S& mass_kg() const { return mass_kg_; }                            ///< 0: none
  const S& lever_m() const { return lever_m_; }  ///< from the pivot to a mass on the rod

  /// Acceleration by which it is pulled back to its place, from q at this rate [m/s^2].
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

  /// What a mass m on the rod adds to the equations of motion of the rest, at the sine and cosine of the
  /// angle th. It is at the distance h from the pivot and q beside the rod, where it is pulled back with the
  /// acceleration p: X = x + h sin(th) + q cos(th), Y = h cos(th) - q sin(th). Lagrange's equation of q is
  ///
  ///   q'' = q th'^2 - p + g sin(th) - x'' cos(th) - h th'',
  ///
  /// which was inserted in those of x and th.
  MotionEquations<S> on_rod(const PlantModel<S>& model, const PlantState<S>& state, const S& s,
                            const S& c) const {
    const S &q = state.attached_m, &rate = state.attached_mps, &w = state.theta_radps;
    const S pull = pull_mps2(model, q, rate), gravity = model.base.gravity_mps2;
    return {mass_kg_ * s * s, -(mass_kg_ * q * s), mass_kg_ * q * q,
            mass_kg_ * (c * (pull - gravity * s) + w * s * (lever_m_ * w + 2.0 * rate)),
            mass_kg_ * (lever_m_ * (pull - q * w * w) + q * (gravity * c - 2.0 * rate * w))};
  }

  /// Adds to the acceleration of a mass on the rod what the motion of cart and pendulum does.
  void carry_on_rod(const PlantState<S>& state, const S& gravity_mps2, PlantState<S>& rate) const {
    const auto [s, c] = elementary::sine_and_cosine(state.theta_rad);
    rate.attached_mps = rate.attached_mps + state.attached_m * state.theta_radps * state.theta_radps +
                        gravity_mps2 * s - rate.cart_mps * c - lever_m_ * rate.theta_radps;
  }

 private:
  enum class Place { nowhere, cart, motor, rod };

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

  template <class E>
  void attach(const S* p, const BaseParameters<S>& base) {
    if constexpr (has_bending_rod<E, S>) {
      place_ = Place::rod;
      const S& inertia_kgm2 = base.inertia_about_pivot_kgm2;
      lever_m_ = E::lever_over_oscillation * inertia_kgm2 / (base.pendulum_mass_kg * base.length_to_com_m);
      mass_kg_ = E::vibrating_share(p) * inertia_kgm2 / (lever_m_ * lever_m_);
    } else {
      place_ = E::motor_is_attached ? Place::motor : Place::cart;
      mass_kg_ = E::attached_mass_kg(p, base.cart_mass_kg);
    }
  }

  Place place_ = Place::nowhere;
  S mass_kg_{0.0}, lever_m_{0.0};
};

}  // namespace upright
