// The rigid body of cart and pendulum, equation (1) of the paper: the force on the cart that a given
// motion requires.
#pragma once

#include "upright/model/plant.hpp"

namespace upright {

/// Cart and pendulum without friction.
struct RigidBody {
  double mass_kg = 0.0;       ///< total mass
  double moment_kgm = 0.0;    ///< m l; 0 without a pendulum
  double inertia_kgm2 = 0.0;  ///< about the pivot; 0 without a pendulum

  /// Length of the simple pendulum with the same motion: 4/3 l for a rod.
  double equivalent_length_m() const { return inertia_kgm2 / moment_kgm; }
};

/// The rigid body of a plant.
inline RigidBody rigid_body(const Plant& plant) {
  RigidBody body{plant.cart_mass_kg};
  if (!plant.pendulum) return body;
  body.mass_kg += plant.pendulum->mass_kg;
  body.moment_kgm = plant.pendulum->mass_kg * plant.pendulum->length_to_com_m;
  body.inertia_kgm2 = plant.pendulum->inertia_about_pivot_kgm2();
  return body;
}

/// cos(th) th'' - sin(th) th'^2: the pendulum's force on its cart is -m l times this.
inline double pendulum_reaction(double sine, double cosine, double theta_radps, double theta_radps2) {
  return cosine * theta_radps2 - sine * theta_radps * theta_radps;
}

/// The angular acceleration of a frictionless pendulum on an accelerated pivot.
inline double pendulum_radps2(double sine, double cosine, double pivot_mps2, double gravity_mps2,
                              double equivalent_length_m) {
  return (gravity_mps2 * sine - cosine * pivot_mps2) / equivalent_length_m;
}

/// The inverse of the mass matrix: accelerations per unit of force on the cart and of torque on the
/// pendulum. It is symmetric.
struct InverseMass {
  double cart_by_force = 0.0;       ///< [1/kg]
  double coupled = 0.0;             ///< cart by torque, and pendulum by force [1/(kg m)]
  double pendulum_by_torque = 0.0;  ///< [1/(kg m^2)]
};

/// At an angle with this cosine.
inline InverseMass inverse_mass(const RigidBody& body, double cosine) {
  if (body.inertia_kgm2 == 0.0) return {1.0 / body.mass_kg, 0.0, 0.0};
  const double off = body.moment_kgm * cosine;
  const double determinant = body.mass_kg * body.inertia_kgm2 - off * off;
  return {body.inertia_kgm2 / determinant, -off / determinant, body.mass_kg / determinant};
}

/// The same with the cart held.
inline InverseMass inverse_mass_at_held_cart(const RigidBody& body) {
  return {0.0, 0.0, body.inertia_kgm2 == 0.0 ? 0.0 : 1.0 / body.inertia_kgm2};
}

}  // namespace upright
