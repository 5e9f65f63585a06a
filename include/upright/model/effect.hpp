// The description of an effect and the hooks through which it enters the plant. Each effect is one file
// in effects/ and one line in effects/all.hpp. The registry, plant files, engines, candidates and
// documents are derived from there.
//
// An effect is a struct with `parameters` and `info`, and any of these static templates on the scalar S,
// where p points at its own parameters in their declared order:
//   S cart_force(p, x, v)                           force on the cart [N]
//   S cart_dry_level(p, x, speed, direction)        its share of the dry level [N] in direction +1 or -1,
//                                                   speed = |v|
//   S cart_dry_level_after(p, since_start_s)        its share a time after the start of the run
//   S cart_dry_level_under(p, motor_n)              its share under a force of the motor of this size [N]
//   bool has_cart_dry_level(p)                      whether it has one with these parameters (without
//                                                   this hook: always)
//   S motor_ripple(p, x)                            change of the motor's constant at x, as a share of it
//   S pivot_torque(p, omega)                        torque on the pendulum about the pivot [N m]
//   S pivot_dry_level(p)                            dry level of the pivot [N m]
//   S actuate(p, volts)                             one stage of the static actuator chain [V], by
//                                                   `actuator_stage`
//   S input_delay_s(p), S motor_time_constant_s(p)
//   S bristle_stiffness(p), S bristle_damping(p)
//   S attached_mass_kg(p, cart_mass_kg)             a mass with a motion of its own along the track [kg]
//   S attached_pull_mps2(p, mass_kg, q, rate)       by which its spring pulls it back to the cart, at q
//                                                   from there [m/s^2]
//   bool motor_is_attached                          whether that mass is the motor, a part of the cart's
//   S vibrating_share(p)                            the share of the pendulum's inertia that moves across
//                                                   its rod, with the hook attached_pull_mps2
//   double lever_over_oscillation                   where on the rod, over the distance of the centre of
//                                                   oscillation from the pivot
//   S drive_deflection_m(p, force)                  position of the motor relative to the cart [m]
//   S encoder_error_m(p, x)                         what the cart's encoder shows too much [m]
//   S lost_mps(p, v)                                velocity that the cart's counter loses of v [m/s]
//   void measure(p, Outputs<S>&)                    one linear stage of the sensors, by `sensor_stage`
//   void correct(p, BaseParameters<S>&)             the true base parameters from the model's
//   double rate_radps(p, v, mass)                   its greatest rate [1/s], by which engines choose
//                                                   their steps
// and the flags `kink_at_cart_rest`, `kink_at_pivot_rest` where the force is not smooth at zero
// velocity.
#pragma once

#include <limits>
#include <span>
#include <string_view>

#include "upright/base/yaml_reader.hpp"

namespace upright {

/// The part of the plant to which an effect belongs.
enum class Enters { cart, actuator, pendulum, sensor, parameter };

/// "cart", "actuator", ...
constexpr std::string_view name_of(Enters enters) {
  switch (enters) {
    case Enters::cart:
      return "cart";
    case Enters::actuator:
      return "actuator";
    case Enters::pendulum:
      return "pendulum";
    case Enters::sensor:
      return "sensor";
    case Enters::parameter:
      return "parameter";
  }
  return "";
}

/// A parameter of an effect.
struct ParameterInfo {
  std::string_view name;  ///< as in plant files, with its unit
  std::string_view unit;  ///< for people; empty: none
  Range range;            ///< what a plant file may have
  double neutral;  ///< value at which the effect vanishes; NaN where there is none (a shape, a position)
  double typical;  ///< order of magnitude on a laboratory cart; start of a search
  std::string_view meaning;  ///< with its symbol in the equation
  /// Of a choice: the words that stand in a plant file for the values 0, 1, ...; else empty.
  std::span<const std::string_view> words = {};
};

/// For a parameter that makes the effect vanish at no value.
constexpr double no_neutral = std::numeric_limits<double>::quiet_NaN();

/// The entry of an effect in the registry.
struct EffectInfo {
  std::string_view kind;                      ///< its name in plant files
  Enters enters;                              ///< where it acts
  bool dry;                                   ///< a level of dry friction of a contact, not a force law
  std::string_view equation;                  ///< in the symbols of the parameters
  std::string_view meaning;                   ///< one phrase for people
  std::span<const ParameterInfo> parameters;  ///< in the order of plant files
};

/// The outputs of the sensors.
template <class S>
struct Outputs {
  S cart_m;     ///< measured position of the cart [m]
  S theta_rad;  ///< measured angle of the pendulum [rad]
};

/// Parameters of the rigid body and the motor, as numbers of a scalar type.
template <class S>
struct BaseParameters {
  S cart_mass_kg;              ///< of the cart alone [kg]
  S pendulum_mass_kg;          ///< of the pendulum [kg]
  S length_to_com_m;           ///< from pivot to centre of mass [m]
  S inertia_about_pivot_kgm2;  ///< of the pendulum [kg m^2]
  S gravity_mps2;              ///< acceleration of gravity [m/s^2]
  S force_per_volt_n;          ///< of the motor [N/V]
  S back_emf_n_per_mps;        ///< of the motor [N s/m]
};

}  // namespace upright
