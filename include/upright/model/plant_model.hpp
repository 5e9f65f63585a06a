// A plant as numbers of a scalar type, with which engines compute. To differentiate with respect to a
// parameter, make it a dual number here.
#pragma once

#include <array>

#include "upright/model/plant.hpp"

namespace upright {

/// Base parameters and effects as numbers of type S.
template <class S>
struct PlantModel {
  BaseParameters<S> base{};                         ///< as in the plant file, before the parameter effects
  bool has_pendulum = false;                        ///< false: the cart is alone
  bool cart_locked = false;                         ///< the cart is held: only the pendulum moves
  EffectSet present;                                ///< which effects it has
  std::array<S, all_parameter_count> parameters{};  ///< contiguous, indexed by parameter_offset
  /// 0: dry friction is a contact with events. Above 0: sgn(v) becomes tanh(smoothing v), without
  /// sticking (for linear design).
  double smoothing = 0.0;
  double start_s = 0.0;  ///< the time at which the run began, for what changes during it [s]

  /// The parameters of effect I.
  template <std::size_t I>
  const S* of() const {
    return &parameters[parameter_offset<I>];
  }

  /// Base parameters after the effects that correct them (cart_mass, pendulum_mass, pendulum_length,
  /// back_emf).
  BaseParameters<S> corrected() const {
    BaseParameters<S> result = base;
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if constexpr (requires { E::correct(of<I>(), result); })
        if (present.has<I>()) E::correct(of<I>(), result);
    });
    return result;
  }
};

/// The model of a plant, with its numbers converted to S.
template <class S>
PlantModel<S> make_model(const Plant& plant, bool cart_locked = false) {
  PlantModel<S> model;
  model.base.cart_mass_kg = S(plant.cart_mass_kg);
  model.has_pendulum = plant.pendulum.has_value();
  if (plant.pendulum) {
    model.base.pendulum_mass_kg = S(plant.pendulum->mass_kg);
    model.base.length_to_com_m = S(plant.pendulum->length_to_com_m);
    model.base.inertia_about_pivot_kgm2 = S(plant.pendulum->inertia_about_pivot_kgm2());
  }
  model.base.gravity_mps2 = S(plant.gravity_mps2);
  model.base.force_per_volt_n = S(plant.motor.force_per_volt_n);
  model.base.back_emf_n_per_mps = S(plant.motor.back_emf_n_per_mps);
  model.cart_locked = cart_locked;
  for (const PlantEffect& effect : plant.effects) {
    model.present.add(effect.number);
    const std::size_t offset = effect_parameter_offset(effect.number);
    for (std::size_t i = 0; i < effect_registry()[effect.number].parameters.size(); ++i)
      model.parameters[offset + i] = S(effect.values[i]);
  }
  return model;
}

/// The same model with the values of its numbers, without derivatives.
template <class S>
PlantModel<double> values_of(const PlantModel<S>& model) {
  PlantModel<double> plain;
  plain.base = {value_of(model.base.cart_mass_kg),      value_of(model.base.pendulum_mass_kg),
                value_of(model.base.length_to_com_m),   value_of(model.base.inertia_about_pivot_kgm2),
                value_of(model.base.gravity_mps2),      value_of(model.base.force_per_volt_n),
                value_of(model.base.back_emf_n_per_mps)};
  plain.has_pendulum = model.has_pendulum;
  plain.cart_locked = model.cart_locked;
  plain.present = model.present;
  plain.smoothing = model.smoothing;
  plain.start_s = model.start_s;
  for (std::size_t i = 0; i < all_parameter_count; ++i) plain.parameters[i] = value_of(model.parameters[i]);
  return plain;
}

}  // namespace upright
