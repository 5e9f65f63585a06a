#include "plant_scale.hpp"

#include <array>
#include <cmath>

#include "upright/model/dynamics.hpp"
#include "upright/model/plant_model.hpp"

namespace upright {

namespace {

// The small cart: the middle of Quanser's IP02 with and without its weight, and of its two pendulums.
constexpr double small_mass_kg = 1.0;
constexpr double small_length_m = 0.4;  // inertia about the pivot over the moment of mass
constexpr double small_moment_kgm = 0.05;
constexpr double small_gravity_mps2 = 9.8;
constexpr double small_force_per_volt_n = 1.7;
/// The time in which a cart alone comes to rest: its mass over its damping.
constexpr double small_coasting_s = 0.08;

/// The power of ten next to a ratio; 1 where there is none.
double decade(double ratio) {
  return ratio > 0.0 && std::isfinite(ratio) ? std::pow(10.0, std::round(std::log10(ratio))) : 1.0;
}

/// Damping of the cart near rest, with the motor's back-EMF [N s/m].
double damping_of(const Plant& plant) {
  const Dynamics<double> dynamics(make_model<double>(plant));
  constexpr double slow_mps = 1e-3;
  PlantState<double> rest{}, moving{};
  moving.cart_mps = slow_mps;
  return (dynamics.cart_smooth_force(rest, 0.0) - dynamics.cart_smooth_force(moving, 0.0)) / slow_mps;
}

}  // namespace

PlantScale scale_of(const Plant& plant) {
  const BaseParameters<double> base = make_model<double>(plant).corrected();
  const double gravity = base.gravity_mps2 / small_gravity_mps2;
  const double mass_kg = base.cart_mass_kg + (plant.pendulum ? base.pendulum_mass_kg : 0.0);
  const double weight = gravity * mass_kg / small_mass_kg;
  PlantScale scale;
  scale.force = decade(weight);
  scale.voltage = decade(weight * small_force_per_volt_n / base.force_per_volt_n);
  if (plant.pendulum) {
    const double moment_kgm = base.pendulum_mass_kg * base.length_to_com_m;
    const double length = base.inertia_about_pivot_kgm2 / moment_kgm / small_length_m;
    scale.length = decade(length);
    scale.speed = decade(std::sqrt(gravity * length));
    scale.rate = decade(std::sqrt(gravity / length));
    scale.torque = decade(gravity * moment_kgm / small_moment_kgm);
  } else {
    const double coasting = mass_kg / damping_of(plant) / small_coasting_s;
    scale.length = decade(gravity * coasting * coasting);
    scale.speed = decade(gravity * coasting);
  }
  return scale;
}

SelectionPolicy policy_for(const Plant& plant) {
  const PlantScale scale = scale_of(plant);
  SelectionPolicy policy;
  policy.motion.still_cart_mps *= scale.speed;
  policy.motion.still_pendulum_radps *= scale.rate;
  policy.motion.no_voltage_v *= scale.voltage;
  policy.location.moving_cart_mps *= scale.speed;
  ResidualWalk& walk = policy.location.walk;
  walk.force_n_per_sqrt_s *= scale.force;
  walk.torque_nm_per_sqrt_s *= scale.torque;
  const std::array start = {scale.length, 1.0,         scale.speed, scale.rate,  scale.length,
                            scale.length, scale.speed, scale.force, scale.torque};
  for (std::size_t i = 0; i < start.size(); ++i) walk.start_variances[i] *= start[i] * start[i];
  PriorPolicy& prior = policy.prior;
  prior.min_stribeck_mps *= scale.speed;
  prior.fastest_stribeck_mps *= scale.speed;
  prior.spring_center_m *= scale.length;
  prior.min_bristle_stiffness_n_per_m *= scale.force / scale.length;
  prior.max_bristle_stiffness_n_per_m *= scale.force / scale.length;
  policy.excitation.arm_m *= scale.length;
  return policy;
}

}  // namespace upright
