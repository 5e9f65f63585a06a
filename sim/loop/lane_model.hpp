// Shared by the engines on SIMD lanes: the plant's model on lanes, the sets of effects that are compiled
// in, and the direction in which a resting cart breaks away.
#pragma once

#include <functional>

#include "lanes.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

/// The inverse is found once.
template <>
class Divisor<Lanes> {
 public:
  explicit Divisor(const Lanes& value) : inverse_(inverse(value)) {}
  template <class T>
  friend T operator/(const T& dividend, const Divisor& by) {
    return dividend * by.inverse_;
  }

 private:
  Lanes inverse_;
};

/// Gives one lane this plant, which has the effects of the others.
inline void put_on_lane(PlantModel<Lanes>& lanes, std::size_t lane, const PlantModel<double>& model) {
  put(lanes.base.cart_mass_kg, lane, model.base.cart_mass_kg);
  put(lanes.base.pendulum_mass_kg, lane, model.base.pendulum_mass_kg);
  put(lanes.base.length_to_com_m, lane, model.base.length_to_com_m);
  put(lanes.base.inertia_about_pivot_kgm2, lane, model.base.inertia_about_pivot_kgm2);
  put(lanes.base.gravity_mps2, lane, model.base.gravity_mps2);
  put(lanes.base.force_per_volt_n, lane, model.base.force_per_volt_n);
  put(lanes.base.back_emf_n_per_mps, lane, model.base.back_emf_n_per_mps);
  for (std::size_t i = 0; i < all_parameter_count; ++i) put(lanes.parameters[i], lane, model.parameters[i]);
}

/// The same plant with numbers of another scalar.
template <class To, class From>
PlantModel<To> with_numbers_of(const PlantModel<From>& model) {
  PlantModel<To> other;
  other.base = {model.base.cart_mass_kg,      model.base.pendulum_mass_kg,
                model.base.length_to_com_m,   model.base.inertia_about_pivot_kgm2,
                model.base.gravity_mps2,      model.base.force_per_volt_n,
                model.base.back_emf_n_per_mps};
  other.has_pendulum = model.has_pendulum;
  other.cart_locked = model.cart_locked;
  other.present = model.present;
  other.smoothing = model.smoothing;
  for (std::size_t i = 0; i < all_parameter_count; ++i) other.parameters[i] = model.parameters[i];
  return other;
}

inline PlantModel<Lanes> on_lanes(const PlantModel<double>& model) {
  return with_numbers_of<Lanes>(model);
}

/// The voltages at the motors over a period: the early one for its first part, if the plant's input delay has
/// a fraction of a period, then the late one.
struct LaneDrive {
  Lanes early_v, late_v;
  double early_s = 0.0, late_s = 0.0;
};

/// The effects in the derivative: without those of the actuator, the sensors and the base parameters,
/// which act once per period or at the beginning.
inline std::uint64_t moving_effects(const EffectSet& present) {
  std::uint64_t mask = 0;
  for (std::size_t i = 0; i < effect_count; ++i)
    if (present.has(i) &&
        (effect_registry()[i].enters == Enters::cart || effect_registry()[i].enters == Enters::pendulum))
      mask |= std::uint64_t{1} << i;
  return mask;
}

template <class E>
constexpr std::uint64_t bit_of = std::uint64_t{1} << effect_index<E>();
constexpr std::uint64_t viscous_set = bit_of<effects::ViscousFriction>;
constexpr std::uint64_t coulomb_set = viscous_set | bit_of<effects::CoulombFriction>;
constexpr std::uint64_t exponential_set = coulomb_set | bit_of<effects::StribeckFriction>;
constexpr std::uint64_t dynamic_set = exponential_set | bit_of<effects::BristleFriction>;

/// Whether these effects are one of the sets above.
template <class Present>
constexpr bool is_common_set = !std::is_same_v<Present, EffectSet>;

/// Whether a cart with these effects can stick: of the sets above, one has no dry friction, and bristles hold
/// a cart without sticking.
template <class Present>
constexpr bool may_stick = true;
template <>
inline constexpr bool may_stick<StaticEffectSet<viscous_set>> = false;
template <>
inline constexpr bool may_stick<StaticEffectSet<dynamic_set>> = false;

/// Whether a cart with these effects may be held by bristles.
template <class Present>
constexpr bool may_have_bristles = false;
template <>
inline constexpr bool may_have_bristles<EffectSet> = true;
template <>
inline constexpr bool may_have_bristles<StaticEffectSet<dynamic_set>> = true;

/// Calls `run` with the plant's effects: common sets at compile time, all others at run time.
template <class Run>
auto with_effects(const EffectSet& present, const Run& run) {
  switch (moving_effects(present)) {
    case viscous_set:
      return run(StaticEffectSet<viscous_set>{});
    case coulomb_set:
      return run(StaticEffectSet<coulomb_set>{});
    case exponential_set:
      return run(StaticEffectSet<exponential_set>{});
    case dynamic_set:
      return run(StaticEffectSet<dynamic_set>{});
    default:
      return run(present);
  }
}

/// The derivative of the state. One copy for the stages of all loops, which takes no longer to run and half
/// as long to compile. (With stick-slip a copy for each stage is 2 to 4 percent faster.)
template <class Present>
[[gnu::flatten, gnu::noinline]] PlantState<Lanes> smooth_rate(const Dynamics<Lanes, Present>& physics,
                                                              const PlantState<Lanes>& state,
                                                              const Lanes& motor_v) {
  return physics.derivative(state, motor_v, {});
}

/// The same for any effects, so that what calls it is compiled once: state and motor voltage in.
using SmoothRate = std::function<PlantState<Lanes>(const PlantState<Lanes>&, const Lanes&)>;
inline SmoothRate smooth_rate_of(const PlantModel<Lanes>& model, const EffectSet& present) {
  SmoothRate rate;
  with_effects(present, [&]<class Present>(const Present& known) {
    rate = [physics = Dynamics<Lanes, Present>(model, known)](const PlantState<Lanes>& state,
                                                              const Lanes& motor_v) {
      return smooth_rate(physics, state, motor_v);
    };
  });
  return rate;
}

/// The load on a resting cart beyond the static friction, forward and backward [N].
struct Excess {
  Lanes forward, backward;
};

template <class Present>
Excess excess_load(const Dynamics<Lanes, Present>& physics, const PlantState<Lanes>& state,
                   const Lanes& motor_v) {
  const Lanes load = physics.cart_load(state, motor_v, Contact::slip_forward);
  return {load - physics.cart_dry_level(state.cart_m, Lanes(0.0), Lanes(1.0)),
          -load - physics.cart_dry_level(state.cart_m, Lanes(0.0), Lanes(-1.0))};
}

/// Direction in which the load moves a resting cart; 0: friction holds it.
inline Lanes direction_of(const Excess& excess) {
  return select(excess.forward > Lanes(0.0), Lanes(1.0),
                select(excess.backward > Lanes(0.0), Lanes(-1.0), Lanes(0.0)));
}

}  // namespace upright
