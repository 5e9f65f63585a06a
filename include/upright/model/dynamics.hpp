// The equations of motion: equations (1) and (2) of the paper with a free inertia about the pivot, and
// all effects through their hooks. No state and no events: an engine decides which contacts stick and
// evaluates the derivatives here.
//
//   (M + m) x''      + m l cos(th) th'' = m l sin(th) th'^2 + F
//   m l cos(th) x''  + J th''           = m g l sin(th) + T
#pragma once

#include <algorithm>
#include <cmath>

#include "upright/model/actuator_chain.hpp"
#include "upright/model/attached_mass.hpp"
#include "upright/model/effect_hooks.hpp"
#include "upright/model/elementary.hpp"
#include "upright/model/motion_equations.hpp"
#include "upright/model/plant_model.hpp"
#include "upright/model/plant_state.hpp"
#include "upright/model/scalar.hpp"
#include "upright/model/sensors.hpp"

namespace upright {

/// The physics of one plant. `Present` is the set of its effects: EffectSet, or a StaticEffectSet for
/// engines that are compiled for it. Constants of a run are computed once, in the constructor.
template <class S, class Present = EffectSet>
class Dynamics {
 public:
  /// `present`: the effects, where they are known at compile time.
  explicit Dynamics(const PlantModel<S>& model, Present present = {})
      : model_(model),
        base_(model.corrected()),
        present_(set_of(model, present)),
        attached_(model, present_, base_) {
    total_mass_ = base_.cart_mass_kg;
    if (attached_.is_motor()) total_mass_ = total_mass_ - attached_.mass_kg();
    coupling_ = S(0.0);
    gravity_torque_ = S(0.0);
    if (model.has_pendulum) {
      total_mass_ = total_mass_ + base_.pendulum_mass_kg;
      coupling_ = base_.pendulum_mass_kg * base_.length_to_com_m;
      inertia_kgm2_ = base_.inertia_about_pivot_kgm2;
      if (attached_.is_on_rod()) leave_out_mass_on_rod();
      gravity_torque_ = coupling_ * base_.gravity_mps2;
      inertia_ = Divisor<S>(inertia_kgm2_);
    }
    mass_ = Divisor<S>(total_mass_);
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if (!present_.template has<I>()) return;
      if constexpr (has_bristles<E, S>) bristles_ = true;
      if constexpr (has_cart_level<E, S>) cart_dry_ = cart_dry_ || acts_as_cart_level<E>(p<I>());
      if constexpr (has_level_of_time<E, S>) cart_dry_ = changes_with_time_ = true;
      if constexpr (has_level_of_load<E, S>) cart_dry_ = depends_on_load_ = true;
      if constexpr (has_lost_counts<E, S>) loses_counts_ = true;
      if constexpr (has_pivot_level<E, S>) pivot_dry_ = model.has_pendulum;
      if constexpr (requires { E::kink_at_cart_rest; }) cart_kink_ = true;
      if constexpr (requires { E::kink_at_pivot_rest; }) pivot_kink_ = model.has_pendulum;
      if constexpr (requires { E::motor_time_constant_s(p<I>()); }) lag_ = true;
    });
  }

  const PlantModel<S>& model() const { return model_; }  ///< the model, as given
  /// Base parameters after the effects that correct them.
  const BaseParameters<S>& base() const { return base_; }
  /// Whether dry friction can hold the cart.
  bool cart_can_stick() const { return cart_dry_ && !bristles_ && model_.smoothing == 0.0; }
  /// Whether the pivot has dry friction, true or smoothed.
  bool pivot_is_dry() const { return pivot_dry_; }
  /// Whether dry friction can hold the pendulum.
  bool pivot_can_stick() const { return pivot_dry_ && model_.smoothing == 0.0; }
  /// The force has a kink at zero velocity: engines should not step across it.
  bool cart_has_kink() const { return cart_can_stick() || cart_kink_; }
  /// Whether a torque of the pivot is not smooth at rest.
  bool pivot_has_kink() const { return pivot_can_stick() || pivot_kink_; }
  bool has_motor_lag() const { return lag_; }                    ///< whether `motor_v` is a state
  bool has_bristle_state() const { return bristles_; }           ///< whether `bristle_m` is a state
  bool has_attached_mass() const { return attached_.exists(); }  ///< whether `attached_m` is a state
  bool loses_counts() const { return loses_counts_; }            ///< `cart_m` may be slower than the cart
  bool has_pendulum() const { return model_.has_pendulum; }      ///< false: the cart is alone
  bool cart_locked() const { return model_.cart_locked; }        ///< true: only the pendulum moves

  bool changes_with_time() const { return changes_with_time_; }  ///< whether `set_time` has an effect

  /// Sets the time, for friction that changes during a run. Until then it has its usual level.
  void set_time(double time_s) {
    if (!changes_with_time_) return;
    level_of_time_ = S(0.0);
    const double since_start_s = std::max(time_s - model_.start_s, 0.0);
    for_each_effect([&]<std::size_t I>() {
      if constexpr (has_level_of_time<EffectAt<I>, S>)
        if (present_.template has<I>())
          level_of_time_ = level_of_time_ + EffectAt<I>::cart_dry_level_after(p<I>(), since_start_s);
    });
  }

  /// Voltage after dead zone, gain, offset and saturation; engines treat delay and lag.
  S actuate(const S& volts) const { return actuated(model_, present_, volts); }
  /// Delay of the plant's input [s].
  S input_delay_s() const { return input_delay_of(model_, present_); }
  /// Of the motor lag [s]; 0: none.
  S motor_time_constant_s() const { return motor_time_constant_of(model_, present_); }

  /// The outputs of the sensors in a state (before quantisation).
  Outputs<S> measure(const PlantState<S>& state) const {
    return sensor_outputs(model_, S(state.cart_m + drive_deflection_m(state)), state.theta_rad);
  }

  /// Level of dry friction of the cart in direction +1 or -1 at a speed >= 0: the friction while sliding,
  /// and at speed 0 the largest static friction.
  S cart_dry_level(const S& x, const S& speed, const S& direction) const {
    return dry_level(x, speed, direction);
  }

  /// Whether a part of that grows with the motor's force.
  bool depends_on_load() const { return depends_on_load_; }
  /// That part, which the level above does not have [N].
  S cart_dry_level_of_load(const PlantState<S>& state, const S& motor_v) const {
    S level(0.0);
    if (!depends_on_load_) return level;
    const S motor_n = absolute(motor_force(state, motor_v));
    for_each_effect([&]<std::size_t I>() {
      if constexpr (has_level_of_load<EffectAt<I>, S>)
        if (present_.template has<I>()) level = level + EffectAt<I>::cart_dry_level_under(p<I>(), motor_n);
    });
    return level;
  }
  /// The whole level, under this voltage at the motor [N].
  S cart_dry_level(const PlantState<S>& state, const S& motor_v, const S& speed, const S& direction) const {
    const S level = cart_dry_level(state.cart_m, speed, direction);
    return depends_on_load_ ? S(level + cart_dry_level_of_load(state, motor_v)) : level;
  }

  /// Largest torque of dry friction in the pivot [N m].
  S pivot_dry_level() const {
    S level(0.0);
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if constexpr (has_pivot_level<E, S>)
        if (present_.template has<I>()) level = level + E::pivot_dry_level(p<I>());
    });
    return level;
  }

  /// Force of the motor including back-EMF [N].
  S motor_force(const PlantState<S>& state, const S& motor_v) const { return motor_force_of(state, motor_v); }

  /// All smooth forces on the cart, with those of the motor and an attached mass, without bristles.
  S cart_smooth_force(const PlantState<S>& state, const S& motor_v) const {
    return smooth_force(state, motor_v);
  }

  /// Torque about the pivot without dry friction [N m].
  S pivot_smooth_torque(const S& omega) const { return smooth_torque(omega); }

  /// Time derivative of the state for a given voltage at the motor (after the complete actuator chain).
  /// The derivative of motor_v is zero: the lag is linear, and engines integrate it exactly.
  PlantState<S> derivative(const PlantState<S>& state, const S& motor_v, Contacts contacts) const {
    PlantState<S> rate{};
    S force = cart_smooth_force(state, motor_v);
    if (bristles_) {
      rate.bristle_m = bristle_rate(state, motor_v);
      force = force - bristle_stiffness() * state.bristle_m - bristle_damping() * rate.bristle_m;
    } else if (cart_dry_) {
      force = force + cart_sliding_force(state, motor_v, contacts.cart);
    }
    const S torque = model_.has_pendulum ? pivot_torque(state.theta_radps, contacts.pivot) : S(0.0);
    const bool cart_rests = model_.cart_locked || (contacts.cart == Contact::stick && cart_can_stick());
    const bool pivot_rests = !model_.has_pendulum || (contacts.pivot == Contact::stick && pivot_can_stick());
    accelerate(state, force, torque, cart_rests, pivot_rests, rate);
    rate.cart_m = cart_rests ? S(0.0) : state.cart_mps;
    if (loses_counts_) rate.cart_m = counted_mps(model_, rate.cart_m);
    rate.theta_rad = pivot_rests ? S(0.0) : state.theta_radps;
    if (attached_.exists()) move_attached_mass(state, motor_v, rate);
    return rate;
  }

  /// Accelerations per unit of force on a cart that does not stick.
  PlantState<S> push(const PlantState<S>& state, Contacts contacts) const {
    const bool pivot_rests = !model_.has_pendulum || (contacts.pivot == Contact::stick && pivot_can_stick());
    PlantState<S> without{}, with{};
    accelerate(state, S(0.0), S(0.0), model_.cart_locked, pivot_rests, without);
    accelerate(state, S(1.0), S(0.0), model_.cart_locked, pivot_rests, with);
    with.cart_mps = with.cart_mps - without.cart_mps;
    with.theta_radps = with.theta_radps - without.theta_radps;
    return with;
  }

  /// Rate at which bristles approach their steady deflection while the cart slides [1/s].
  double bristle_relaxation_radps(const PlantState<S>& state) const {
    const double v = value_of(state.cart_mps);
    const S direction(v < 0.0 ? -1.0 : 1.0);
    const double level = value_of(cart_dry_level(state, state.motor_v, absolute(state.cart_mps), direction));
    return value_of(bristle_stiffness()) * std::abs(v) / std::max(level, smallest_level_n);
  }

  /// The motion before the cart's dry friction acts, for engines whose lanes differ in the modes of their
  /// contacts.
  struct Balance {
    S sine;    ///< of the angle
    S cosine;  ///< of the angle
    S force;   ///< on the cart, without dry friction [N]
    S torque;  ///< about the pivot, without gravity [N m]
  };
  /// For plants with a pendulum.
  Balance balance(const PlantState<S>& state, const S& motor_v) const {
    const auto [s, c] = elementary::sine_and_cosine(state.theta_rad);
    return {s, c, cart_smooth_force(state, motor_v), pivot_smooth_torque(state.theta_radps)};
  }

  /// The same of a cart whose contact is the only one. The motion may be of another scalar T than the plant,
  /// as its Taylor series in time is.
  template <class T>
  struct CartBalance {
    T load;   ///< the force that holds the cart if it rests [N]
    T turn;   ///< acceleration of the pendulum on a resting cart [rad/s^2]
    T lever;  ///< by how much an acceleration of the cart turns the pendulum back [rad/m]
    T mass;   ///< that a force on the cart accelerates [kg]
  };
  /// For plants with a pendulum.
  template <class T>
  CartBalance<T> cart_balance(const PlantState<T>& state, const elementary::SineAndCosine<T>& angle,
                              const S& motor_v) const {
    const T torque = gravity_torque_ * angle.sine + smooth_torque(state.theta_radps);
    const T turn = torque / inertia_, coupling = coupling_ * angle.cosine, lever = coupling / inertia_;
    const T force =
        smooth_force(state, motor_v) + coupling_ * (angle.sine * (state.theta_radps * state.theta_radps));
    return {force - coupling * turn, turn, lever, total_mass_ - coupling * lever};
  }
  /// The same in one call.
  CartBalance<S> cart_balance(const PlantState<S>& state, const S& motor_v) const {
    return cart_balance(state, elementary::sine_and_cosine(state.theta_rad), motor_v);
  }

  /// Of the cart and of the pendulum.
  template <class T>
  struct Accelerations {
    T cart_mps2;     ///< [m/s^2]
    T theta_radps2;  ///< [rad/s^2]
  };
  /// With the mode of the cart's contact as a number: -1 or 1 slides in that direction, 0 sticks.
  template <class T>
  Accelerations<T> accelerations(const PlantState<T>& state, const CartBalance<T>& at,
                                 const S& direction) const {
    const T speed = positive_part(T(direction * state.cart_mps));
    const T level = dry_level(state.cart_m, speed, T(direction));
    const T cart_mps2 = select(direction == S(0.0), T(0.0), T((at.load - direction * level) / at.mass));
    return {cart_mps2, at.turn - at.lever * cart_mps2};
  }

  /// As `derivative`, with the mode of the cart's contact as a number.
  PlantState<S> derivative_by_direction(const PlantState<S>& state, const CartBalance<S>& at,
                                        const S& direction) const {
    const Accelerations<S> found = accelerations(state, at, direction);
    PlantState<S> rate{};
    rate.cart_m = state.cart_mps;
    rate.theta_rad = state.theta_radps;
    rate.cart_mps = found.cart_mps2;
    rate.theta_radps = found.theta_radps2;
    return rate;
  }
  /// The same in one call.
  PlantState<S> derivative_by_direction(const PlantState<S>& state, const S& motor_v,
                                        const S& direction) const {
    return derivative_by_direction(state, cart_balance(state, motor_v), direction);
  }

  /// By how much a step of 1 ms by a Taylor series of order 4 may change the velocity of the cart [m/s].
  S longest_sweep_mps() const {
    S longest(1e6);  // any
    for_each_effect([&]<std::size_t I>() {
      if constexpr (requires { EffectAt<I>::longest_sweep_mps(p<I>(), model_.base.cart_mass_kg); })
        if (present_.template has<I>())
          longest = smaller(longest, EffectAt<I>::longest_sweep_mps(p<I>(), model_.base.cart_mass_kg));
    });
    return longest;
  }

  /// As `derivative`, of a cart on bristles that moves in this direction: the motion continues smoothly a
  /// little beyond the reversal.
  PlantState<S> bristle_derivative_by_direction(const PlantState<S>& state, const S& motor_v,
                                                const S& direction) const {
    const Balance at = balance(state, motor_v);
    PlantState<S> rate{};
    rate.bristle_m = bristle_rate(state, S(direction * state.cart_mps), direction);
    const S force = at.force - bristle_stiffness() * state.bristle_m - bristle_damping() * rate.bristle_m;
    accelerate(state, at.sine, at.cosine, force, at.torque, false, false, rate);
    rate.cart_m = state.cart_mps;
    rate.theta_rad = state.theta_radps;
    return rate;
  }

  /// The motion before the dry friction of cart and pivot acts, for engines whose lanes differ in the modes
  /// of both contacts. Modes are numbers: -1 or 1 slides in that direction, 0 sticks.
  struct AppliedForces {
    S force;        ///< on the cart [N]
    S torque;       ///< about the pivot [N m]
    S coupling;     ///< between both, m l cos(th) [kg m]
    S bristle_mps;  ///< rate of the bristles
  };
  /// For plants with a pendulum. `cart`: the direction of its motion, for bristles.
  AppliedForces applied_forces(const PlantState<S>& state, const S& motor_v, const S& cart) const {
    const Balance at = balance(state, motor_v);
    AppliedForces all{at.force, gravity_torque_ * at.sine + at.torque, coupling_ * at.cosine, S(0.0)};
    if (bristles_) {
      all.bristle_mps = bristle_rate(state, S(cart * state.cart_mps), cart);
      all.force = all.force - bristle_stiffness() * state.bristle_m - bristle_damping() * all.bristle_mps;
    }
    all.force = all.force + coupling_ * at.sine * state.theta_radps * state.theta_radps;
    return all;
  }
  /// The force that holds a resting cart, with the pivot in this mode.
  S cart_load(const AppliedForces& at, const S& pivot) const {
    const S theta_radps2 = (at.torque - pivot_dry_level() * pivot) / inertia_;
    return at.force - at.coupling * select(pivot == S(0.0), S(0.0), theta_radps2);
  }
  /// The torque that holds a resting pendulum, with the cart in this mode, at this level of its friction.
  S pivot_load(const AppliedForces& at, const S& cart, const S& level) const {
    const S cart_mps2 = (at.force - level * cart) / mass_;
    if (!cart_can_stick()) return at.torque - at.coupling * cart_mps2;
    return at.torque - at.coupling * select(cart == S(0.0), S(0.0), cart_mps2);
  }
  /// As `derivative`. `level`: of the cart's friction, 0 where nothing holds it.
  PlantState<S> derivative_by_directions(const PlantState<S>& state, const AppliedForces& at, const S& cart,
                                         const S& level, const S& pivot) const {
    const S f_n = at.force - level * cart, tau_nm = at.torque - pivot_dry_level() * pivot;
    const S& inertia = base_.inertia_about_pivot_kgm2;
    const S inverse = S(1.0) / (total_mass_ * inertia - at.coupling * at.coupling);
    const auto pivot_held = pivot == S(0.0);
    PlantState<S> rate{};
    rate.cart_m = state.cart_mps;
    rate.theta_rad = state.theta_radps;
    rate.bristle_m = at.bristle_mps;
    rate.cart_mps = select(pivot_held, f_n / mass_, (inertia * f_n - at.coupling * tau_nm) * inverse);
    rate.theta_radps = select(pivot_held, S(0.0), S((total_mass_ * tau_nm - at.coupling * f_n) * inverse));
    if (!cart_can_stick()) return rate;
    const auto cart_held = cart == S(0.0);
    rate.cart_mps = select(cart_held, S(0.0), rate.cart_mps);
    rate.theta_radps = select(cart_held, select(pivot_held, S(0.0), S(tau_nm / inertia_)), rate.theta_radps);
    return rate;
  }

  /// The force that dry friction must balance to hold a resting cart: motor, smooth forces and the
  /// pendulum's reaction, with the pivot in its present mode.
  S cart_load(const PlantState<S>& state, const S& motor_v, Contact pivot) const {
    PlantState<S> at_rest = state;
    at_rest.cart_mps = S(0.0);
    const S force = cart_smooth_force(at_rest, motor_v);
    if (!model_.has_pendulum) return force;
    const auto [s, c] = elementary::sine_and_cosine(state.theta_rad);
    const bool pivot_rests = pivot == Contact::stick && pivot_can_stick();
    const S torque = pivot_rests ? S(0.0) : pivot_torque(state.theta_radps, pivot);
    if (attached_.is_on_rod()) return with_rod(state, s, c, force, torque).cart_load(pivot_rests);
    S theta_acceleration(0.0);
    if (!pivot_rests) theta_acceleration = (gravity_torque_ * s + torque) / inertia_;
    return force + coupling_ * (s * state.theta_radps * state.theta_radps - c * theta_acceleration);
  }

  /// The torque that dry friction must balance to hold a resting pendulum, with the cart's present mode.
  S pivot_load(const PlantState<S>& state, const S& motor_v, Contact cart) const {
    const auto [s, c] = elementary::sine_and_cosine(state.theta_rad);
    PlantState<S> at_rest = state;
    at_rest.theta_radps = S(0.0);
    S load = gravity_torque_ * s, coupling = coupling_ * c;
    if (attached_.is_on_rod()) {
      const MotionEquations<S> at = with_rod(at_rest, s, c, S(0.0), S(0.0));
      load = at.torque_nm;
      coupling = at.coupling_kgm;
    }
    const bool cart_rests = model_.cart_locked || (cart == Contact::stick && cart_can_stick());
    if (cart_rests) return load;
    return load - coupling * derivative(at_rest, motor_v, {cart, Contact::stick}).cart_mps;
  }

  /// Greatest rate of the motion in this state [1/s]; engines keep their steps below a fraction of its
  /// inverse. Without `bristles`, the rate of the bristles is excluded.
  double fastest_rate_radps(const PlantState<S>& state, bool bristles = true) const {
    const double mass = value_of(min_cart_inertia());
    const double v = value_of(state.cart_mps);
    double rate = value_of(base_.back_emf_n_per_mps) / mass + std::abs(value_of(state.theta_radps));
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if constexpr (requires(const double* q) { E::rate_radps(q, v, mass); })
        if (present_.template has<I>() && (bristles || !has_bristles<E, S>)) {
          std::array<double, parameter_count_of<I>> plain;
          for (std::size_t i = 0; i < plain.size(); ++i) plain[i] = value_of(p<I>()[i]);
          rate += E::rate_radps(plain.data(), v, mass);
        }
    });
    if (bristles_ && bristles) rate += bristle_relaxation_radps(state);
    if (cart_dry_ && model_.smoothing > 0.0 && std::abs(v) * model_.smoothing < 3.0)
      rate += model_.smoothing * value_of(cart_dry_level(state.cart_m, S(0.0), S(1.0))) / mass;
    return rate;
  }

  /// Lower bound of the level of bristles [N]: where it vanishes, they slip freely without a division by
  /// zero.
  static constexpr double smallest_level_n = 1e-6;
  S bristle_stiffness() const { return sum_of_bristles<true>(); }  ///< of the bristles [N/m]
  S bristle_damping() const { return sum_of_bristles<false>(); }   ///< of the bristles [N s/m]

  /// Smallest inertia that a force on the cart acts on [kg].
  S min_cart_inertia() const {
    if (!model_.has_pendulum) return total_mass_;
    return total_mass_ - coupling_ * coupling_ / inertia_;
  }

 private:
  static Present set_of([[maybe_unused]] const PlantModel<S>& model, [[maybe_unused]] const Present& known) {
    if constexpr (std::is_same_v<Present, EffectSet>)
      return model.present;
    else
      return known;
  }

  template <class T>
  T dry_level(const T& x, const T& speed, const T& direction) const {
    T level(0.0);
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if constexpr (Present::template may_have<I>() && has_cart_level<E, S>)
        if (present_.template has<I>()) level = level + E::cart_dry_level(p<I>(), x, speed, direction);
      if constexpr (Present::template may_have<I>() && has_level_of_time<E, S>)
        if (present_.template has<I>()) level = level + T(level_of_time_);
    });
    return positive_part(level);
  }

  template <class T>
  T motor_force_of(const PlantState<T>& state, const S& motor_v) const {
    const S push = base_.force_per_volt_n * motor_v;
    const T motor_mps = attached_.is_motor() ? T(state.cart_mps + state.attached_mps) : state.cart_mps;
    const T drag = base_.back_emf_n_per_mps * motor_mps;
    T force = push - drag;
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if constexpr (Present::template may_have<I>() && requires { E::motor_ripple(p<I>(), S()); })
        if (present_.template has<I>()) {
          const T r = E::motor_ripple(p<I>(), state.cart_m);
          force = force + r * (push - (r + S(2.0)) * drag);  // 1 + r in the push, squared in the drag
        }
    });
    return force;
  }

  template <class T>
  T smooth_force(const PlantState<T>& state, const S& motor_v) const {
    T force = attached_.is_motor() ? T(0.0) : motor_force_of(state, motor_v);
    if (attached_.exists() && !attached_.is_on_rod())
      force = force + attached_.mass_kg() * attached_.pull_mps2(model_, state.attached_m, state.attached_mps);
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if constexpr (Present::template may_have<I>() && requires { E::cart_force(p<I>(), S(), S()); })
        if (present_.template has<I>()) force = force + E::cart_force(p<I>(), state.cart_m, state.cart_mps);
    });
    return force;
  }

  template <class T>
  T smooth_torque(const T& omega) const {
    T torque(0.0);
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if constexpr (Present::template may_have<I>() && requires { E::pivot_torque(p<I>(), S()); })
        if (present_.template has<I>()) torque = torque + E::pivot_torque(p<I>(), omega);
    });
    return torque;
  }

  void move_attached_mass(const PlantState<S>& state, const S& motor_v, PlantState<S>& rate) const {
    rate.attached_m = state.attached_mps;
    rate.attached_mps = -attached_.pull_mps2(model_, state.attached_m, state.attached_mps);
    if (attached_.is_on_rod()) return attached_.carry_on_rod(state, base_.gravity_mps2, rate);
    rate.attached_mps = rate.attached_mps - rate.cart_mps;
    if (attached_.is_motor())
      rate.attached_mps = rate.attached_mps + motor_force(state, motor_v) / attached_.mass_kg();
  }

  S drive_deflection_m(const PlantState<S>& state) const {
    S deflection(0.0);
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if constexpr (requires { E::drive_deflection_m(p<I>(), state.motor_v); })
        if (present_.template has<I>())
          deflection = deflection + E::drive_deflection_m(p<I>(), motor_force(state, state.motor_v));
    });
    return deflection;
  }

  template <std::size_t I>
  const S* p() const {
    return &model_.parameters[parameter_offset<I>];
  }

  S bristle_rate(const PlantState<S>& state, const S& motor_v) const {
    const S direction = select(state.cart_mps < S(0.0), S(-1.0), S(1.0)), speed = absolute(state.cart_mps);
    return bristle_rate_at(state, speed, cart_dry_level(state, motor_v, speed, direction));
  }
  S bristle_rate(const PlantState<S>& state, const S& speed, const S& direction) const {
    return bristle_rate_at(state, speed, cart_dry_level(state.cart_m, positive_part(speed), direction));
  }
  S bristle_rate_at(const PlantState<S>& state, const S& speed, const S& level) const {
    const S safe = select(level > S(smallest_level_n), level, S(smallest_level_n));
    return state.cart_mps - bristle_stiffness() * speed * state.bristle_m / safe;
  }

  S cart_sliding_force(const PlantState<S>& state, const S& motor_v, Contact contact) const {
    const bool smooth = model_.smoothing > 0.0;
    if (!smooth && contact == Contact::stick) return S(0.0);
    const S direction =
        smooth ? elementary::tanh(S(model_.smoothing) * state.cart_mps) : S(static_cast<double>(contact));
    const S speed = smooth ? absolute(state.cart_mps) : positive_part(S(direction * state.cart_mps));
    return -cart_dry_level(state, motor_v, speed, direction) * direction;
  }

  /// Without gravity.
  S pivot_torque(const S& omega, Contact contact) const {
    const S torque = pivot_smooth_torque(omega);
    return pivot_dry_ ? S(torque + pivot_sliding_torque(omega, contact)) : torque;
  }

  S pivot_sliding_torque(const S& omega, Contact contact) const {
    if (model_.smoothing > 0.0) return -pivot_dry_level() * elementary::tanh(S(model_.smoothing) * omega);
    return -pivot_dry_level() * S(static_cast<double>(contact));
  }

  void accelerate(const PlantState<S>& state, const S& force, const S& torque, bool cart_rests,
                  bool pivot_rests, PlantState<S>& rate) const {
    rate.cart_mps = S(0.0);
    rate.theta_radps = S(0.0);
    if (!model_.has_pendulum) {
      if (!cart_rests) rate.cart_mps = force / mass_;
      return;
    }
    const auto [s, c] = elementary::sine_and_cosine(state.theta_rad);
    accelerate(state, s, c, force, torque, cart_rests, pivot_rests, rate);
  }

  /// The rigid bodies of a pendulum whose rod bends are those without the mass on the rod.
  void leave_out_mass_on_rod() {
    const S moment_kgm = attached_.mass_kg() * attached_.lever_m();
    total_mass_ = total_mass_ - attached_.mass_kg();
    coupling_ = coupling_ - moment_kgm;
    inertia_kgm2_ = inertia_kgm2_ - moment_kgm * attached_.lever_m();
  }

  /// With a rod that bends. `force` and `torque` as for `accelerate`.
  MotionEquations<S> with_rod(const PlantState<S>& state, const S& s, const S& c, const S& force,
                              const S& torque) const {
    const S centripetal_n = coupling_ * s * state.theta_radps * state.theta_radps;
    const MotionEquations<S> rest{total_mass_, coupling_ * c, inertia_kgm2_, force + centripetal_n,
                                  gravity_torque_ * s + torque};
    return rest + attached_.on_rod(model_, state, s, c);
  }

  /// The same with a pendulum. Eight parameters: callers know the sine and cosine of its angle already.
  void accelerate(const PlantState<S>& state, const S& s, const S& c, const S& force, const S& torque,
                  bool cart_rests, bool pivot_rests, PlantState<S>& rate) const {
    if (attached_.is_on_rod())
      return with_rod(state, s, c, force, torque).solve(cart_rests, pivot_rests, rate);
    const S f_n = force + coupling_ * s * state.theta_radps * state.theta_radps;
    if (pivot_rests) {
      if (!cart_rests) rate.cart_mps = f_n / mass_;
      return;
    }
    const S tau_nm = gravity_torque_ * s + torque;
    if (cart_rests) {
      rate.theta_radps = tau_nm / inertia_;
      return;
    }
    solve_both(total_mass_, S(coupling_ * c), base_.inertia_about_pivot_kgm2, f_n, tau_nm, rate);
  }

  template <bool Stiffness>
  S sum_of_bristles() const {
    S sum(0.0);
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if constexpr (has_bristles<E, S>)
        if (present_.template has<I>())
          sum = sum + (Stiffness ? E::bristle_stiffness(p<I>()) : E::bristle_damping(p<I>()));
    });
    return sum;
  }

  PlantModel<S> model_;
  BaseParameters<S> base_;
  Present present_;
  AttachedMass<S, Present> attached_;
  S total_mass_, coupling_, gravity_torque_, inertia_kgm2_{1.0};
  Divisor<S> inertia_{S(1.0)}, mass_{S(1.0)};  ///< about the pivot, and of both bodies
  S level_of_time_{0.0};                       ///< of the cart's dry friction at the time that was set
  bool bristles_ = false, cart_dry_ = false, pivot_dry_ = false, cart_kink_ = false, pivot_kink_ = false,
       lag_ = false, changes_with_time_ = false, depends_on_load_ = false, loses_counts_ = false;
};

}  // namespace upright
