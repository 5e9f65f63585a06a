// The events of a dry contact within a step, by lane: of the cart on its track, or of the pendulum in its
// pivot. All of it is inlined into EventPeriod, which has the reasons.
#pragma once

#include "lane_model.hpp"

namespace upright {

/// One contact before and after a step. Velocities and accelerations count along the direction of its motion.
struct LaneContact {
  Lanes speed, growth;          ///< at the beginning
  Lanes end_speed, end_growth;  ///< at the end
};

/// What a contact met within a step.
struct LaneMeeting {
  LaneMask stops, breaks;  ///< at its end
  LaneMask beyond;         ///< too far before its end: the step does not count
  Lanes to_stop_s;         ///< from its end
  Lanes retry_s;           ///< length of the next step after one that does not count

  /// So near to a stop, in time, a step may end; the polynomial's error is below 1e-10 of the velocities.
  static constexpr double near_stop_s = 1e-5;
  /// A breakaway is placed so long after the load passes the static friction, and accepted up to twice that.
  /// The load grows by some newtons per second: velocities are changed by less than 1e-10 m/s.
  static constexpr double late_breakaway_s = 1e-6;
  /// A step that is taken again keeps within these parts of its length.
  static constexpr double shortest_part = 0.02, longest_part = 0.98;
};

/// Stops within a step of this length and near its end. `left_s`: of the period, from the end of the step.
inline LaneMeeting stops_of(const LaneContact& contact, const Lanes& length_s, const Lanes& left_s,
                            const LaneMask& active, const Lanes& per_length) {
  const Lanes zero(0.0), two(2.0), h = length_s;
  const Lanes from = contact.speed, growth = contact.growth, to = contact.end_speed,
              end_growth = contact.end_growth;
  const LaneMask none = active & !active;
  LaneMeeting met{none, none, none, zero, h};
  const Lanes bend = (end_growth - growth) * per_length;
  // No parabola of this bend stops within that time from a higher velocity.
  const Lanes near_s(LaneMeeting::near_stop_s);
  const LaneMask slow =
      active & (end_growth < zero) & (absolute(to) <= near_s * (near_s * absolute(bend) - two * end_growth));
  if (any(slow)) {
    const Lanes under = end_growth * end_growth - two * bend * to;
    const LaneMask falls = slow & (under >= zero);
    met.to_stop_s = two * to / select(falls, sqrt(under) - end_growth, Lanes(1.0));
    met.stops = falls & (absolute(met.to_stop_s) <= near_s) & (met.to_stop_s <= left_s);
  }
  met.beyond = active & (to < zero) & !met.stops;
  if (!any(met.beyond)) return met;
  // The first zero after the beginning of the parabola through what the step met.
  const Lanes square = (to - from - growth * h) * per_length * per_length;
  const Lanes root = sqrt(larger(zero, growth * growth - Lanes(4.0) * square * from));
  const LaneMask rises = growth > zero;
  const Lanes stop_s = select(rises, growth + root, two * from) /
                       select(met.beyond, select(rises, Lanes(-2.0) * square, root - growth), Lanes(1.0));
  const Lanes shortest = Lanes(LaneMeeting::shortest_part) * h,
              longest = Lanes(LaneMeeting::longest_part) * h;
  met.retry_s = select(stop_s > shortest, select(stop_s < longest, stop_s, longest), shortest);
  return met;
}

/// Contacts at rest whose load passes the static friction within a step. `excess`: of the load over what
/// friction holds, at its beginning and its end.
inline void find_breakaways(const LaneMask& resting, const Lanes& excess, const Lanes& end_excess,
                            const Lanes& length_s, LaneMeeting& met) {
  const Lanes zero(0.0);
  const LaneMask over = resting & (end_excess > zero);
  const Lanes late_s = end_excess * length_s / select(over, end_excess - smaller(excess, zero), Lanes(1.0));
  met.breaks = over & (late_s <= Lanes(2.0 * LaneMeeting::late_breakaway_s));
  const LaneMask too_late = over & !met.breaks;
  met.beyond = met.beyond | too_late;
  const Lanes earlier_s = length_s - late_s + Lanes(LaneMeeting::late_breakaway_s);
  // Of a motion that has left all bounds, the load may be no number.
  const Lanes retry_s = select(earlier_s < length_s, earlier_s, Lanes(LaneMeeting::shortest_part) * length_s);
  met.retry_s = select(too_late, retry_s, met.retry_s);
}

/// In lanes whose contacts are to stay at rest once they are, what would be taken again is a stop.
inline void stay_at_rest(LaneMeeting& met, const LaneMask& stay) {
  met.to_stop_s = select(met.beyond, Lanes(0.0), met.to_stop_s);
  met.stops = met.stops | (met.beyond & stay);
  met.beyond = met.beyond & !stay;
  met.breaks = met.breaks & !stay;
}

/// Of what two contacts met, keeps what comes first. Both then have the same times.
inline void keep_first(LaneMeeting& a, LaneMeeting& b, const Lanes& length_s) {
  const Lanes never(1.0);  // s; steps are far shorter
  const LaneMask beyond = a.beyond | b.beyond;
  a.retry_s = b.retry_s =
      smaller(select(a.beyond, a.retry_s, length_s), select(b.beyond, b.retry_s, length_s));
  a.beyond = b.beyond = beyond;
  const Lanes a_s = select(a.stops, a.to_stop_s, never), b_s = select(b.stops, b.to_stop_s, never),
              first_s = smaller(a_s, b_s);
  a.to_stop_s = b.to_stop_s = first_s;
  a.stops = a.stops & (a_s <= first_s) & !beyond;
  b.stops = b.stops & (b_s <= first_s) & !beyond;
  // The stop of one changes the load on the other, which then settles anew.
  const LaneMask goes_on = !(beyond | a.stops | b.stops);
  a.breaks = a.breaks & goes_on;
  b.breaks = b.breaks & goes_on;
}

/// The modes of both contacts.
struct LaneModes {
  Lanes cart, pivot;
};

/// Consistent modes in these lanes, as `settled_contacts`: contacts at rest stick, or accelerate in the
/// direction of their load. `forward_n` and `backward_n`: static friction of the cart. Seven parameters: what
/// the step knows already, in registers.
template <class Physics>
void settle_contacts(const Physics& physics, const PlantState<Lanes>& state,
                     const typename Physics::AppliedForces& at, const Lanes& forward_n,
                     const Lanes& backward_n, const LaneMask& lanes, LaneModes& modes) {
  const Lanes zero(0.0), level_nm = physics.pivot_dry_level();
  const LaneMask pivot_rests = state.theta_radps == zero, cart_moves = !(state.cart_mps == zero);
  const LaneMask cart_rests = physics.cart_can_stick() ? !cart_moves : cart_moves & !cart_moves;
  const auto holds = [&](double mode, const Lanes& load, const Lanes& forward, const Lanes& backward) {
    if (mode > 0.0) return load > forward;
    if (mode < 0.0) return -load > backward;
    return (load <= forward) & (-load <= backward);
  };
  const Lanes sliding_n =
      physics.cart_can_stick()
          ? physics.cart_dry_level(state.cart_m, absolute(state.cart_mps), sign_of(state.cart_mps))
          : zero;
  LaneMask open = lanes;
  modes.cart = select(lanes & cart_rests, zero, modes.cart);
  modes.pivot = select(lanes & pivot_rests, zero, modes.pivot);
  const LaneModes moving = modes;
  for (const double cart : {0.0, 1.0, -1.0}) {
    const Lanes level_n = select(cart_rests, cart < 0.0 ? backward_n : forward_n, sliding_n);
    const Lanes load_nm = physics.pivot_load(at, Lanes(cart), level_n);
    const LaneMask cart_fits = cart_rests | (moving.cart == Lanes(cart));
    for (const double pivot : {0.0, 1.0, -1.0}) {
      const Lanes load_n = physics.cart_load(at, Lanes(pivot));
      const LaneMask fits = open & cart_fits & (pivot_rests | (moving.pivot == Lanes(pivot))) &
                            (!cart_rests | holds(cart, load_n, forward_n, backward_n)) &
                            (!pivot_rests | holds(pivot, load_nm, level_nm, level_nm));
      modes.cart = select(fits, Lanes(cart), modes.cart);
      modes.pivot = select(fits, Lanes(pivot), modes.pivot);
      open = open & !fits;
    }
    if (!any(open)) return;
  }
}

}  // namespace upright
