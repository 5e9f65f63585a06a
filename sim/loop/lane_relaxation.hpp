// Bristles whose relaxation is too fast for the steps of a period, by lane: the exponential method of
// upright/sim/runge_kutta.hpp (Relaxation, which has its source), each lane with its own coefficients.
#pragma once

#include <array>

#include "lane_model.hpp"
#include "upright/sim/runge_kutta.hpp"

namespace upright {

/// The longest step in units of the inverse of the greatest rate that it must resolve, as in the event
/// engine.
constexpr double bristle_step_fraction = 0.2;

/// Coefficients of the bristles at the beginning of a step, as in `Bristles`, and how long it may be.
struct LaneBristles {
  Lanes relaxation_radps, drift_mps2, cart_mps_per_m, theta_radps_per_m;
  Lanes longest_s;
};

/// phi_1 to phi_3 and exp of c <= 0.
struct LanePhi {
  Lanes zero, one, two, three;

  explicit LanePhi(const Lanes& c) {
    const Lanes unit(1.0), half(0.5);
    const LaneMask near = absolute(c) < unit;
    const Lanes far = select(near, -unit, c);
    const Lanes e = exp(far), far_one = (e - unit) / far, far_two = (far_one - unit) / far;
    const Lanes within = select(near, c, Lanes(0.0));
    constexpr int last = 17;  // number of terms: the remainder is below the rounding error
    Lanes term(1.0);
    for (int k = last; k > 3; --k) term = unit + term * within * Lanes(1.0 / k);
    three = select(near, term * Lanes(1.0 / 6.0), (far_two - half) / far);
    two = select(near, half + within * three, far_two);
    one = select(near, unit + within * two, far_one);
    zero = select(near, unit + within * one, e);
  }
};

/// Over a step of each lane's own length.
class LaneRelaxation {
 public:
  LaneRelaxation(const LaneBristles& bristles, const Lanes& h) : of_(bristles) {
    const Lanes rate = of_.relaxation_radps, drift = of_.drift_mps2, q = Lanes(0.5) * h;
    const LanePhi half(-rate * q), whole(-rate * h);
    half_decay = half.zero;
    decay = whole.zero;
    half_weight = q * half.one;
    whole_weights = {h * (whole.one - Lanes(3.0) * whole.two + Lanes(4.0) * whole.three),
                     h * (Lanes(2.0) * whole.two - Lanes(4.0) * whole.three),
                     h * (Lanes(4.0) * whole.three - whole.two)};
    const Lanes to_middle = q * q * half.two;
    first_half_m = drift * to_middle;
    second_half_m = drift * (q * q * half.one + to_middle);
    whole_m = drift * h * h * whole.two;
    half_drift_mps = drift * q;
    drift_mps = drift * h;
  }

  Lanes smooth(const PlantState<Lanes>& at, const PlantState<Lanes>& rate, const Lanes& drift) const {
    return rate.bristle_m + of_.relaxation_radps * at.bristle_m - drift;
  }
  void put(PlantState<Lanes>& at, const Lanes& bristle_m) const {
    const Lanes aside = bristle_m - at.bristle_m;
    at.bristle_m = bristle_m;
    at.cart_mps = at.cart_mps - of_.cart_mps_per_m * aside;
    at.theta_radps = at.theta_radps - of_.theta_radps_per_m * aside;
  }

  Lanes half_decay, decay, half_weight;
  std::array<Lanes, 3> whole_weights;
  Lanes first_half_m, second_half_m, whole_m, half_drift_mps, drift_mps;

 private:
  LaneBristles of_;
};

/// The bristles of moving carts at this rate of the motion. `direction` of the cart: -1, 0 or 1.
template <class Present>
LaneBristles bristles_of(const Dynamics<Lanes, Present>& physics, const PlantState<Lanes>& state,
                         const PlantState<Lanes>& rate, const Lanes& direction) {
  const Lanes zero(0.0), one(1.0), stiffness = physics.bristle_stiffness();
  const auto relaxation_at = [&](const PlantState<Lanes>& at) {
    const Lanes speed = positive_part(direction * at.cart_mps);
    const Lanes level = physics.cart_dry_level(at.cart_m, speed, direction);
    return stiffness * speed / larger(level, Lanes(Dynamics<Lanes>::smallest_level_n));
  };
  constexpr double aside_s = 1e-7;
  const Lanes relaxation = relaxation_at(state);
  const Lanes growth =
      (relaxation_at(moved(state, rate, Lanes(aside_s))) - relaxation) * Lanes(1.0 / aside_s);
  const PlantState<Lanes> push = physics.push(state, {});
  const Lanes slowed = physics.bristle_damping() * push.cart_mps;
  const LaneMask moves = absolute(state.cart_mps) > zero;
  const Lanes way =
      select(moves, absolute(rate.bristle_m) / select(moves, absolute(state.cart_mps), one), zero);
  const Lanes change = absolute(growth);
  const Lanes fastest = smaller(way, one) * relaxation +
                        smaller(sqrt(change), change / larger(relaxation, one)) +
                        sqrt(stiffness * push.cart_mps) + slowed;
  return {relaxation + slowed, rate.cart_mps + slowed * rate.bristle_m - growth * state.bristle_m, slowed,
          physics.bristle_damping() * push.theta_radps, Lanes(bristle_step_fraction) / fastest};
}

}  // namespace upright
