// Both equations of motion of cart and pendulum, in one state.
#pragma once

#include "upright/model/plant_state.hpp"

namespace upright {

/// Sets both accelerations in `rate`. The arguments are those of MotionEquations.
template <class S>
void solve_both(const S& cart_kg, const S& coupling_kgm, const S& pendulum_kgm2, const S& force_n,
                const S& torque_nm, PlantState<S>& rate) {
  const S inverse_determinant = S(1.0) / (cart_kg * pendulum_kgm2 - coupling_kgm * coupling_kgm);
  rate.cart_mps = (pendulum_kgm2 * force_n - coupling_kgm * torque_nm) * inverse_determinant;
  rate.theta_radps = (cart_kg * torque_nm - coupling_kgm * force_n) * inverse_determinant;
}

/// Mass matrix and right-hand side, with a = x'' and b = th'':
///
///   cart a + coupling b     = force
///   coupling a + pendulum b = torque
template <class S>
struct MotionEquations {
  S cart_kg;        ///< that moves with the cart
  S coupling_kgm;   ///< m l cos(th) of a rigid pendulum
  S pendulum_kgm2;  ///< inertia about the pivot
  S force_n;        ///< on the cart
  S torque_nm;      ///< about the pivot

  /// The sum, of two parts of a plant.
  friend MotionEquations operator+(const MotionEquations& a, const MotionEquations& b) {
    return {a.cart_kg + b.cart_kg, a.coupling_kgm + b.coupling_kgm, a.pendulum_kgm2 + b.pendulum_kgm2,
            a.force_n + b.force_n, a.torque_nm + b.torque_nm};
  }

  /// The force that holds a resting cart [N].
  S cart_load(bool pivot_rests) const {
    return pivot_rests ? force_n : S(force_n - coupling_kgm * torque_nm / pendulum_kgm2);
  }

  /// Sets the accelerations in `rate`, where they are 0, of what does not rest.
  void solve(bool cart_rests, bool pivot_rests, PlantState<S>& rate) const {
    if (pivot_rests) {
      if (!cart_rests) rate.cart_mps = force_n / cart_kg;
      return;
    }
    if (cart_rests) {
      rate.theta_radps = torque_nm / pendulum_kgm2;
      return;
    }
    solve_both(cart_kg, coupling_kgm, pendulum_kgm2, force_n, torque_nm, rate);
  }
};

}  // namespace upright
