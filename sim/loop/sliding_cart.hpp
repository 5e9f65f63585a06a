// The motion of carts that dry friction may hold, in lanes whose directions of motion are given.
#pragma once

#include "lane_model.hpp"

namespace upright {

struct CartRate {
  PlantState<Lanes> of;
  Lanes load_n;  ///< that the friction must hold if the cart is to rest; 0 of a cart that cannot stick
};

template <class Present>
class SlidingCart {
 public:
  SlidingCart(const PlantModel<Lanes>& model, const Present& present)
      : physics_(model, present), sticks_(may_stick<Present> && physics_.cart_can_stick()) {}

 protected:
  using State = PlantState<Lanes>;

  /// One copy for the stages of a step, as of `smooth_rate`. The load does not depend on the direction.
  [[gnu::flatten, gnu::noinline]] CartRate rate_of_cart(const State& state, const Lanes& motor_v,
                                                        const Lanes& direction) const {
    if (!sticks_) return {frictionless_rate(state, motor_v, direction), Lanes(0.0)};
    const auto balance = physics_.cart_balance(state, motor_v);
    return {physics_.derivative_by_direction(state, balance, direction), balance.load};
  }

  /// Of a cart that nothing holds. At rest its direction makes no difference to it.
  State frictionless_rate(const State& state, const Lanes& motor_v, const Lanes& direction) const {
    if constexpr (may_have_bristles<Present>)
      if (physics_.has_bristle_state())
        return physics_.bristle_derivative_by_direction(state, motor_v, direction);
    return physics_.derivative(state, motor_v, {});
  }

  Dynamics<Lanes, Present> physics_;
  bool sticks_;
};

}  // namespace upright
