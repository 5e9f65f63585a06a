// Which hooks of dry friction and of states of its own an effect E has, for numbers S (effect.hpp).
#pragma once

namespace upright {

/// A share of the cart's dry level that depends on the motion.
template <class E, class S>
constexpr bool has_cart_level = requires(const S* p, const S& x) {
  E::cart_dry_level(p, x, x, x);
};
/// Whether it has that share with these parameters.
template <class E, class S>
bool acts_as_cart_level(const S* p) {
  if constexpr (requires { E::has_cart_dry_level(p); }) {
    return E::has_cart_dry_level(p);
  } else {
    return true;
  }
}
/// A share that depends on the time since the start of the run.
template <class E, class S>
constexpr bool has_level_of_time = requires(const S* p) {
  E::cart_dry_level_after(p, 0.0);
};
/// A share that depends on the motor's force.
template <class E, class S>
constexpr bool has_level_of_load = requires(const S* p) {
  E::cart_dry_level_under(p, *p);
};
/// A dry level of the pivot.
template <class E, class S>
constexpr bool has_pivot_level = requires(const S* p) {
  E::pivot_dry_level(p);
};
/// Bristles, which carry the dry friction of the cart.
template <class E, class S>
constexpr bool has_bristles = requires(const S* p) {
  E::bristle_stiffness(p);
};
/// A counter of the cart's position that loses counts.
template <class E, class S>
constexpr bool has_lost_counts = requires(const S* p) {
  E::lost_mps(p, *p);
};
/// A rod that bends: a share of the pendulum with states of its own.
template <class E, class S>
constexpr bool has_bending_rod = requires(const S* p) {
  E::vibrating_share(p);
};
/// A mass with states of its own, on the cart or on the rod.
template <class E, class S>
constexpr bool has_attached_mass = has_bending_rod<E, S> || requires(const S* p) {
  E::attached_mass_kg(p, *p);
};

}  // namespace upright
