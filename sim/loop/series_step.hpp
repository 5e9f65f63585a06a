// One step by Taylor series in time, of order 4, of a cart in its contact and a pendulum that turns freely.
// Where the physics is analytic it takes the place of the four stages of Runge-Kutta's method: sine, cosine,
// exponential and inverse are evaluated once, and the series shows where the cart stops or breaks away.
//
// The physics is evaluated for series of degree 0 to 3, each of which gives the next coefficient. What
// they have in common the compiler computes once, as all of it is inlined.
#pragma once

#include "lane_model.hpp"
#include "lane_series.hpp"

namespace upright {

/// The motion from a state, until an event.
class SeriesMotion {
 public:
  template <class Physics>
  [[gnu::always_inline]] SeriesMotion(const Physics& physics, const PlantState<Lanes>& state,
                                      const Lanes& motor_v)
      : from_(state) {
    known_.at.cart_mps = LaneSeries<0>(state.cart_mps);
    known_.at.theta_radps = LaneSeries<0>(state.theta_radps);
    known_.at.theta_rad = LaneSeries<0>(state.theta_rad);
    const auto [sine, cosine] = both_of(state.theta_rad);
    known_.angle = {LaneSeries<0>(sine), LaneSeries<0>(cosine)};
    load_n.value = physics.cart_balance(known_.at, known_.angle, motor_v).load.value;
  }

  /// With the cart in this mode.
  template <class Physics>
  [[gnu::always_inline]] void develop(const Physics& physics, const Lanes& motor_v, const Lanes& mode) {
    const auto next = [&](const auto& known) {
      return longer_motion(known, rates(physics, known, motor_v, mode));
    };
    const auto all = rates(physics, next(next(next(known_))), motor_v, mode);
    cart_mps2 = all.cart_mps2;
    theta_radps2 = all.theta_radps2;
    load_n = all.load;
  }

  LaneSeries<3> cart_mps2, theta_radps2;
  LaneSeries<3> load_n;  ///< that holds the cart if it rests

  /// A step of this length, or shorter where it would change the velocity of the cart by more than this.
  [[gnu::always_inline]] Lanes within_sweep(const Lanes& length_s, const CoarseLanes& longest_mps) const {
    constexpr double shortest_s = 2e-5;  // a bound on the work
    const CoarseLanes h(length_s);
    const CoarseLanes sweep = h * (absolute(cart_mps2.coarse) + 0.5f * (h * absolute(cart_mps2.more[0])));
    const auto beyond = longest_mps < sweep;
    if (!xsimd::any(beyond)) return length_s;
    // Others keep their length to the last bit, whatever their neighbours do.
    const CoarseLanes part = select(beyond, longest_mps * rough_inverse(sweep), CoarseLanes(1.0f));
    return larger(smaller(length_s, Lanes(shortest_s)), length_s * part.widened());
  }
  [[gnu::always_inline]] Lanes cart_mps_after(const Lanes& h) const {
    return velocity(from_.cart_mps, cart_mps2, h);
  }
  [[gnu::always_inline]] Lanes load_n_after(const Lanes& h) const {
    const CoarseLanes t(h);
    return load_n.value + h * (load_n.more[0] + t * (load_n.more[1] + t * load_n.more[2])).widened();
  }
  /// All but the velocity of the cart.
  [[gnu::always_inline]] void move(PlantState<Lanes>& state, const Lanes& h) const {
    state.cart_m = position(from_.cart_m, from_.cart_mps, cart_mps2, h);
    state.theta_rad = position(from_.theta_rad, from_.theta_radps, theta_radps2, h);
    state.theta_radps = velocity(from_.theta_radps, theta_radps2, h);
  }

 private:
  template <int degree>
  struct Known {
    PlantState<LaneSeries<degree>> at;
    elementary::SineAndCosine<LaneSeries<degree>> angle;
  };
  template <int degree>
  struct Rates {
    LaneSeries<degree> cart_mps2, theta_radps2, load;
  };

  template <class Physics, int degree>
  [[gnu::always_inline]] static Rates<degree> rates(const Physics& physics, const Known<degree>& known,
                                                    const Lanes& motor_v, const Lanes& mode) {
    const auto balance = physics.cart_balance(known.at, known.angle, motor_v);
    const auto found = physics.accelerations(known.at, balance, mode);
    return {found.cart_mps2, found.theta_radps2, balance.load};
  }
  template <int degree>
  [[gnu::always_inline]] static Known<degree + 1> longer_motion(const Known<degree>& known,
                                                                const Rates<degree>& rates) {
    Known<degree + 1> more;
    more.at.theta_rad = integral(known.at.theta_rad, known.at.theta_radps);
    more.at.theta_radps = integral(known.at.theta_radps, rates.theta_radps2);
    more.at.cart_mps = integral(known.at.cart_mps, rates.cart_mps2);
    more.angle = longer(known.angle, more.at.theta_rad);
    return more;
  }

  [[gnu::always_inline]] static Lanes velocity(const Lanes& begin, const LaneSeries<3>& rate,
                                               const Lanes& h) {
    const CoarseLanes t(h);
    const auto& [first, second, third] = rate.more;
    const CoarseLanes bend = 0.5f * first + t * (1.0f / 3.0f * second + t * (0.25f * third));
    return begin + h * (rate.value + h * bend.widened());
  }
  [[gnu::always_inline]] static Lanes position(const Lanes& begin, const Lanes& velocity,
                                               const LaneSeries<3>& rate, const Lanes& h) {
    const CoarseLanes t(h);
    const CoarseLanes bend =
        0.5f * rate.coarse + t * (1.0f / 6.0f * rate.more[0] + t * (1.0f / 12.0f * rate.more[1]));
    return begin + h * (velocity + h * bend.widened());
  }

  const PlantState<Lanes>& from_;
  Known<0> known_;
};

/// What each lane meets within its step.
struct SeriesMeeting {
  LaneMask stops, breaks;  ///< at its end
  LaneMask rests;          ///< rounding set the cart off against its acceleration: it rests after all
  LaneMask retries;        ///< it does not count and is taken again, no longer than `retry_s`
  LaneMask slides_less;    ///< ends before the period, with a cart that slides on
  Lanes length_s;          ///< of the step
  Lanes retry_s;
};

/// A polynomial in time that falls to zero at an event.
struct EventPolynomial {
  Lanes value, slope;
  CoarseLanes second, third, fourth;
};

/// A zero of it.
struct EventTime {
  Lanes at_s;
  Lanes left;      ///< value of the polynomial there, before the improvement
  LaneMask found;  ///< otherwise no zero is near
};

/// The time of the first event of a step of this length that meets one: the zero of the parabola at its
/// beginning, improved once by Newton's method. Without such a zero, the lowest point of the parabola, from
/// where it is sought again. At the beginning itself there is none where the polynomial rises.
[[gnu::always_inline]] inline EventTime first_zero(const EventPolynomial& g, const Lanes& length_s) {
  /// Newton's method squares the error: after an improvement by less, a jerk of 100 m/s^3 leaves 1e-10 m/s.
  constexpr double exact_s = 1e-6;
  constexpr float smallest = 1e-20f;  // of what is divided by, so that quotients stay numbers
  const CoarseLanes zero(0.0f), least(smallest), g0(g.value), g1(g.slope), length(length_s);
  const CoarseLanes square = g1 * g1 - 4.0f * g.second * g0, twice = 2.0f * g.second;
  const CoarseLanes root = rough_sqrt(larger(square, least));
  const auto rises = zero < g1, misses = square < zero;
  const CoarseLanes dividend = select(rises, g1 + root, select(misses, -g1, g0 + g0));
  const CoarseLanes divisor = select(rises, -twice, select(misses, twice, root - g1));
  const CoarseLanes t = smaller(dividend * rough_inverse(larger(divisor, least)), length);
  const auto slope_at = [&](const CoarseLanes& time) {
    return g1 + time * (twice + time * (3.0f * g.third + time * (4.0f * g.fourth)));
  };
  const auto bend_at = [&](const CoarseLanes& time) { return g.second + time * (g.third + time * g.fourth); };
  const Lanes near_s = t.widened(), left = g.value + near_s * (g.slope + near_s * bend_at(t).widened());
  const CoarseLanes last = slope_at(t);
  const Lanes improvement = left * rough_inverse(larger(-last, least)).widened();
  const Lanes zero_s = larger(near_s + improvement, Lanes(0.0));
  const LaneMask found = (absolute(improvement) <= Lanes(exact_s)) & (zero_s <= length_s);
  return {select(found, zero_s, smaller(near_s, length_s)), left, found};
}

}  // namespace upright
