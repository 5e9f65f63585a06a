// How the motion gets through one period with the voltage held where the cart may stop, break away or reverse
// within it: all lanes pass through their events side by side.
//
// Each lane takes steps of its own length, all lanes one step at a time; whichever has come to the end of its
// period begins the next. What a lane does depends on its own state only, so that its neighbours change no
// bit of it.
//
//   - A cart that slows down steps to where it would stop with its present deceleration. From the end of a
//     step near a stop a polynomial in time leads to the stop, forward or back.
//   - A step that went beyond a stop, or too far beyond a breakaway, is taken again, shorter.
//   - A cart breaks away a little after the load has passed the static friction, so that its acceleration has
//     the direction of its motion. The stop that ends a slip is sought back from the end of a step, never
//     from the zero of the velocity at which the slip began, so that a slip of any length is taken as a
//     whole.
#pragma once

#include "lane_builds.hpp"
#include "lane_model.hpp"
#include "lane_relaxation.hpp"
#include "upright/sim/runge_kutta.hpp"

namespace upright {

template <class Present>
class EventPeriod {
 public:
  EventPeriod(const LaneParts& parts, const PlantModel<Lanes>& model, const Present& present)
      : physics_(model, present),
        sticks_(may_stick<Present> && physics_.cart_can_stick()),
        stiff_(parts.stiff_bristles) {}

  using State = PlantState<Lanes>;
  using Mask = LaneMask;

  /// Where each lane is in its period.
  struct Steps {
    State state{};
    Lanes direction;     ///< of the motion, -1 or 1; 0: at rest
    Lanes motor_v;       ///< now
    Lanes left_s;        ///< until this voltage ends
    Lanes late_v;        ///< the voltage that follows then
    Lanes late_s;        ///< and how long it acts; 0: the period ends
    Lanes longest_s;     ///< that the next step may be: the last one went beyond an event
    Lanes taken;         ///< steps of this period
    LaneMask settles{};  ///< the cart has come to rest, and the load decides how it goes on
  };

  /// The lanes at the end of their periods.
  static LaneMask arrived(const Steps& steps) { return steps.left_s == Lanes(0.0); }

  /// Begins a period in these lanes.
  static void begin(Steps& steps, const LaneMask& lanes, const LaneDrive& drive) {
    const Lanes zero(0.0);
    const bool two_parts = drive.early_s > 0.0;
    steps.late_v = select(lanes, drive.late_v, steps.late_v);
    steps.late_s = two_parts ? select(lanes, Lanes(drive.late_s), steps.late_s) : zero;
    steps.taken = select(lanes, zero, steps.taken);
    hold(steps, lanes, two_parts ? drive.early_v : drive.late_v,
         Lanes(two_parts ? drive.early_s : drive.late_s));
  }

  /// One step in every lane that is within a period.
  [[gnu::flatten]] void advance(Steps& steps) const {
    const LaneMask stay = steps.taken >= Lanes(max_steps);
    const Begin begin = begin_of(steps);
    Step step{length_of(steps, begin, stay), {}, {}};
    const auto rate = [&](const State& at, Stage stage) {
      const Rate found = rate_of(at, steps.motor_v, steps.direction);
      if (stage == Stage::end) step.last = found;
      return found.of;
    };
    if (stiff_)
      step_on_bristles(steps, begin, step);
    else
      step.end = runge_kutta_4(rate, steps.state, begin.rate, step.length_s);
    take(steps, begin, step, stay);
    const LaneMask next = (steps.left_s == Lanes(0.0)) & (steps.late_s > Lanes(0.0));
    if (any(next)) {
      hold(steps, next, steps.late_v, steps.late_s);
      steps.late_s = select(next, Lanes(0.0), steps.late_s);
    }
  }

 private:
  /// So near to a stop, in time, a step may end; the polynomial's error is below 1e-10 of the velocities.
  static constexpr double near_stop_s = 1e-5;
  /// A breakaway is placed so long after the load passes the static friction, and accepted up to twice that.
  /// The load grows by some newtons per second: velocities are changed by less than 1e-10 m/s.
  static constexpr double late_breakaway_s = 1e-6;
  /// After so many steps in a period a cart that stops stays at rest until its end: a bound on the work.
  static constexpr double max_steps = 48.0;
  /// No step towards a stop is shorter, so that quotients by its length stay finite.
  static constexpr double shortest_s = 1e-12;
  /// No step that stiff bristles shorten is shorter: a bound on the work.
  static constexpr double shortest_on_bristles_s = 2e-6;
  /// A step that is taken again keeps within these parts of its length.
  static constexpr double shortest_part = 0.02, longest_part = 0.98;

  struct Rate {
    State of;
    Lanes load_n;  ///< that the friction must hold if the cart is to rest
  };
  struct Begin {
    State rate;
    Lanes forward_n, backward_n;  ///< the static friction of a resting cart
    Lanes excess_n;               ///< of the load over it
  };
  struct Step {
    Lanes length_s;
    State end;
    Rate last;  ///< at its end, by the last stage
  };

  /// Holds a voltage in these lanes. The load on carts at rest changes with it.
  static void hold(Steps& steps, const LaneMask& lanes, const Lanes& motor_v, const Lanes& duration_s) {
    const Lanes v = steps.state.cart_mps;
    steps.motor_v = select(lanes, motor_v, steps.motor_v);
    steps.direction = select(lanes, sign_of(v), steps.direction);
    steps.left_s = select(lanes, duration_s, steps.left_s);
    steps.longest_s = select(lanes, duration_s, steps.longest_s);
    steps.settles = (lanes & (v == Lanes(0.0))) | (steps.settles & !lanes);
  }

  Lanes excess_of(const Lanes& load_n, const Begin& begin) const {
    return larger(load_n - begin.forward_n, -load_n - begin.backward_n);
  }

  [[gnu::flatten, gnu::noinline]] Begin begin_of(Steps& steps) const {
    Begin begin{};
    const State& at = steps.state;
    const Lanes& motor_v = steps.motor_v;
    if (!sticks_) {
      begin.rate = unheld_rate(at, motor_v, steps.direction);
      steps.direction = select(steps.settles, sign_of(begin.rate.cart_mps), steps.direction);
      return begin;
    }
    const auto balance = physics_.balance(at, motor_v);
    if (any(at.cart_mps == Lanes(0.0))) {
      begin.forward_n = physics_.cart_dry_level(at.cart_m, Lanes(0.0), Lanes(1.0));
      begin.backward_n = physics_.cart_dry_level(at.cart_m, Lanes(0.0), Lanes(-1.0));
      const Lanes load = physics_.cart_load(at, balance);
      begin.excess_n = excess_of(load, begin);
      const Lanes moves = select(begin.excess_n > Lanes(0.0), sign_of(load), Lanes(0.0));
      steps.direction = select(steps.settles, moves, steps.direction);
    }
    begin.rate = physics_.derivative_by_direction(at, balance, steps.direction);
    return begin;
  }

  /// A step, shortened to what stiff bristles need, in which their relaxation is exponential.
  [[gnu::flatten, gnu::noinline]] void step_on_bristles(const Steps& steps, const Begin& begin,
                                                        Step& step) const {
    if constexpr (may_have_bristles<Present>) {
      const LaneBristles bristles = bristles_of(physics_, steps.state, begin.rate, steps.direction);
      const Lanes shortest = smaller(step.length_s, Lanes(shortest_on_bristles_s));
      step.length_s = larger(shortest, smaller(step.length_s, bristles.longest_s));
      const auto rate = [&](const State& at, Stage stage) {
        const Rate found = rate_of(at, steps.motor_v, steps.direction);
        if (stage == Stage::end) step.last = found;
        return found.of;
      };
      const LaneRelaxation relaxation(bristles, step.length_s);
      step.end = runge_kutta_4(rate, steps.state, begin.rate, step.length_s, &relaxation);
    }
  }

  /// One copy for the stages of a step, as in SmoothPeriod.
  [[gnu::flatten, gnu::noinline]] Rate rate_of(const State& state, const Lanes& motor_v,
                                               const Lanes& direction) const {
    if (!sticks_) return {unheld_rate(state, motor_v, direction), Lanes(0.0)};
    const auto balance = physics_.balance(state, motor_v);
    return {physics_.derivative_by_direction(state, balance, direction), physics_.cart_load(state, balance)};
  }

  /// Of a cart that nothing holds. At rest its direction makes no difference to it.
  State unheld_rate(const State& state, const Lanes& motor_v, const Lanes& direction) const {
    if constexpr (may_have_bristles<Present>)
      if (physics_.has_bristle_state())
        return physics_.bristle_derivative_by_direction(state, motor_v, direction);
    return physics_.derivative(state, motor_v, {});
  }

  /// To the end of the period, or to where a cart that slows down would stop.
  static Lanes length_of(const Steps& steps, const Begin& begin, const LaneMask& stay) {
    const Lanes zero(0.0), speed = steps.direction * steps.state.cart_mps,
                           growth = steps.direction * begin.rate.cart_mps;
    const Lanes longest = smaller(steps.left_s, steps.longest_s);
    const LaneMask slows = (growth < zero) & (speed > zero) & !stay;
    const Lanes stop_s = speed / select(slows, -growth, Lanes(1.0));
    return select(slows & (stop_s < longest), larger(stop_s, smaller(longest, Lanes(shortest_s))), longest);
  }

  /// What a step met, by lane.
  struct Met {
    LaneMask stops, breaks;  ///< at its end
    LaneMask beyond;         ///< too far before its end: the step does not count
    Lanes to_stop_s;         ///< from its end
    Lanes retry_s;           ///< length of the next step after one that does not count
  };

  /// Takes the step in the lanes where it met nothing, or ends at what it met.
  void take(Steps& steps, const Begin& begin, const Step& step, const LaneMask& stay) const {
    const Lanes zero(0.0), one(1.0), h = step.length_s;
    const LaneMask active = steps.left_s > zero;
    const Lanes per_length = select(active, one / select(active, h, one), zero);
    Met met = stops_of(steps, begin, step, active, per_length);
    if (sticks_ && any(active & (steps.direction == zero))) find_breakaways(steps, begin, step, active, met);
    met.to_stop_s = select(met.beyond, zero, met.to_stop_s);
    met.stops = met.stops | (met.beyond & stay);
    met.beyond = met.beyond & !stay;
    met.breaks = met.breaks & !stay;
    const LaneMask counts = !met.beyond;
    const Lanes more = select(met.stops, met.to_stop_s, zero), bend = Lanes(0.5) * more * per_length;
    const auto on = [&](Lanes State::*of) {
      const Lanes first = begin.rate.*of, last = step.last.of.*of;
      steps.state.*of = select(counts, step.end.*of + more * (last + bend * (last - first)), steps.state.*of);
    };
    on(&State::cart_m);
    on(&State::theta_rad);
    on(&State::cart_mps);
    on(&State::theta_radps);
    if constexpr (may_have_bristles<Present>) on(&State::bristle_m);
    steps.state.cart_mps = select(met.stops, zero, steps.state.cart_mps);
    // Rounding may have sent a cart off against its acceleration: it rests after all.
    const LaneMask rests = met.stops | (met.beyond & (steps.state.cart_mps == zero) &
                                        (steps.direction * begin.rate.cart_mps <= zero));
    steps.direction = select(rests, zero, select(met.breaks, sign_of(step.last.load_n), steps.direction));
    steps.left_s = select(counts, steps.left_s - h - more, steps.left_s);
    steps.longest_s = select(counts, steps.left_s, met.retry_s);
    steps.settles = met.stops & !stay;
    const Lanes met_one = select(met.beyond | met.stops | met.breaks, one, zero);
    steps.taken = steps.taken + (stiff_ ? met_one : one);
  }

  /// Stops within a step and near its end.
  static Met stops_of(const Steps& steps, const Begin& begin, const Step& step, const LaneMask& active,
                      const Lanes& per_length) {
    const Lanes zero(0.0), two(2.0), h = step.length_s;
    const Lanes from = steps.direction * steps.state.cart_mps, growth = steps.direction * begin.rate.cart_mps,
                to = steps.direction * step.end.cart_mps,
                end_growth = steps.direction * step.last.of.cart_mps;
    const LaneMask none = active & !active;
    Met met{none, none, none, zero, h};
    const Lanes bend = (end_growth - growth) * per_length;
    const Lanes under = end_growth * end_growth - two * bend * to;
    const LaneMask falls = active & (end_growth < zero) & (under >= zero);
    met.to_stop_s = two * to / select(falls, sqrt(under) - end_growth, Lanes(1.0));
    met.stops = falls & (absolute(met.to_stop_s) <= Lanes(near_stop_s)) & (met.to_stop_s <= steps.left_s - h);
    met.beyond = active & (to < zero) & !met.stops;
    if (!any(met.beyond)) return met;
    // The first zero after the beginning of the parabola through what the step met.
    const Lanes square = (to - from - growth * h) * per_length * per_length;
    const Lanes root = sqrt(larger(zero, growth * growth - Lanes(4.0) * square * from));
    const LaneMask rises = growth > zero;
    const Lanes stop_s = select(rises, growth + root, two * from) /
                         select(met.beyond, select(rises, Lanes(-2.0) * square, root - growth), Lanes(1.0));
    const Lanes shortest = Lanes(shortest_part) * h, longest = Lanes(longest_part) * h;
    met.retry_s = select(stop_s > shortest, select(stop_s < longest, stop_s, longest), shortest);
    return met;
  }

  /// Resting carts whose load passes the static friction within a step.
  void find_breakaways(const Steps& steps, const Begin& begin, const Step& step, const LaneMask& active,
                       Met& met) const {
    const Lanes zero(0.0), excess = excess_of(step.last.load_n, begin);
    const LaneMask over = active & (steps.direction == zero) & (excess > zero);
    const Lanes late_s =
        excess * step.length_s / select(over, excess - smaller(begin.excess_n, zero), Lanes(1.0));
    met.breaks = over & (late_s <= Lanes(2.0 * late_breakaway_s));
    const LaneMask too_late = over & !met.breaks;
    met.beyond = met.beyond | too_late;
    const Lanes earlier_s = step.length_s - late_s + Lanes(late_breakaway_s);
    // Of a motion that has left all bounds, the load may be no number.
    const Lanes retry_s = select(earlier_s < step.length_s, earlier_s, Lanes(shortest_part) * step.length_s);
    met.retry_s = select(too_late, retry_s, met.retry_s);
  }

  Dynamics<Lanes, Present> physics_;
  bool sticks_;
  bool stiff_;  ///< bristles relax too fast for the classical method
};

}  // namespace upright
