// How the motion gets through one period with the voltage held where the cart may stop, break away or reverse
// within it, or the pendulum in a pivot with dry friction: all lanes pass through their events side by side.
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
//   - So does the pendulum. A step ends at what either meets first; the stop of one changes the load on the
//     other, so that both settle.
#pragma once

#include "lane_builds.hpp"
#include "lane_contacts.hpp"
#include "lane_model.hpp"
#include "lane_motor.hpp"
#include "lane_relaxation.hpp"
#include "series_step.hpp"
#include "sliding_cart.hpp"
#include "upright/sim/runge_kutta.hpp"

namespace upright {

/// `second`: the pendulum may stick too, or the motor lag. Compiled apart: in one copy for all, loops
/// without either took up to 20 percent longer.
template <class Present, bool second>
class EventPeriod : private SlidingCart<Present> {
  using SlidingCart<Present>::physics_;
  using SlidingCart<Present>::sticks_;
  using SlidingCart<Present>::frictionless_rate;
  using SlidingCart<Present>::rate_of_cart;

 public:
  EventPeriod(const LaneParts& parts, const PlantModel<Lanes>& model, const Present& present)
      : SlidingCart<Present>(model, present),
        series_(with_numbers_of<LaneConstant>(model), present),
        motor_(model),
        pivot_sticks_(physics_.pivot_can_stick()),
        cart_turns_(physics_.cart_has_kink()),
        by_series_(sticks_ && parts.short_series),
        stiff_(parts.stiff_bristles) {
    if (by_series_) sweep_mps_ = CoarseLanes(physics_.longest_sweep_mps());
    if (sticks_ && is_common_set<Present>) find_static_friction(Lanes(0.0), everywhere_);
  }

  using State = PlantState<Lanes>;
  using Mask = LaneMask;
  static constexpr bool may_lag = second;

  /// Where each lane is in its period.
  struct Steps {
    State state{};
    LaneModes modes;     ///< directions of the motions, -1 or 1; 0: at rest
    Lanes drive_v;       ///< now
    Lanes left_s;        ///< until this voltage ends
    Lanes late_v;        ///< the voltage that follows then
    Lanes late_s;        ///< and how long it acts; 0: the period ends
    Lanes longest_s;     ///< that the next step may be: the last one went beyond an event
    Lanes taken;         ///< steps of this period
    LaneMask settles{};  ///< a contact has come to rest, and the load decides how it goes on
  };

  /// The lanes at the end of their periods.
  static LaneMask arrived(const Steps& steps) { return steps.left_s == Lanes(0.0); }

  /// Begins a period in these lanes.
  void begin(Steps& steps, const LaneMask& lanes, const LaneDrive& drive) const {
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
    if constexpr (may_step_by_series)
      if (by_series_) return advance_by_series(steps);
    const LaneMask stay = steps.taken >= Lanes(max_steps);
    const Begin begin = begin_of(steps);
    Step step{length_of(steps, begin, stay), {}, {}};
    if (stiff_)
      step_on_bristles(steps, begin, step);
    else if (!lags())
      step.end = runge_kutta_4(rates_of(steps, steps.drive_v, steps.drive_v, step), steps.state, begin.rate,
                               step.length_s);
    if constexpr (second)
      if (motor_.lags()) step_of_lagging_motor(steps, step);
    take(steps, begin, step, stay);
    const LaneMask next = (steps.left_s == Lanes(0.0)) & (steps.late_s > Lanes(0.0));
    if (any(next)) {
      hold(steps, next, steps.late_v, steps.late_s);
      steps.late_s = select(next, Lanes(0.0), steps.late_s);
    }
  }

 private:
  /// After so many steps in a period a contact that stops stays at rest until its end: a bound on the work.
  static constexpr double max_steps = 48.0;
  /// No step towards a stop is shorter, so that quotients by its length stay finite.
  static constexpr double shortest_s = 1e-12;
  /// No step that stiff bristles shorten is shorter: a bound on the work.
  static constexpr double shortest_on_bristles_s = 2e-6;

  struct BothRate : CartRate {
    Lanes pivot_load_nm;  ///< and the pendulum
  };
  using Rate = std::conditional_t<second, BothRate, CartRate>;
  /// Of a resting cart, forward and backward.
  struct StaticFriction {
    Lanes forward_n, backward_n;
  };
  struct CartBegin : StaticFriction {
    State rate;
    Lanes excess_n;  ///< of the load over the static friction
  };
  struct BothBegin : CartBegin {
    Lanes pivot_excess_nm;  ///< the same of a resting pendulum
  };
  using Begin = std::conditional_t<second, BothBegin, CartBegin>;
  struct Step {
    Lanes length_s;
    State end;
    Rate last;  ///< at its end, by the last stage
  };

  /// Whether the pendulum can stick, and the cart be without events.
  bool pivot_sticks() const { return second && pivot_sticks_; }
  bool lags() const { return motor_.lags(); }

  /// Holds a voltage in these lanes. The load on contacts at rest changes with it.
  void hold(Steps& steps, const LaneMask& lanes, const Lanes& drive_v, const Lanes& duration_s) const {
    const Lanes v = steps.state.cart_mps;
    steps.drive_v = select(lanes, drive_v, steps.drive_v);
    steps.modes.cart = select(lanes, sign_of(v), steps.modes.cart);
    steps.left_s = select(lanes, duration_s, steps.left_s);
    steps.longest_s = select(lanes, duration_s, steps.longest_s);
    LaneMask rests = v == Lanes(0.0);
    if (pivot_sticks()) {
      if (!cart_turns_) steps.modes.cart = Lanes(0.0);
      const Lanes w = steps.state.theta_radps;
      steps.modes.pivot = select(lanes, sign_of(w), steps.modes.pivot);
      rests = rests | (w == Lanes(0.0));
    }
    steps.settles = (lanes & rests) | (steps.settles & !lanes);
  }

  const Lanes& motor_of(const Steps& steps) const { return lags() ? steps.state.motor_v : steps.drive_v; }

  static Lanes excess_of(const Lanes& load, const Lanes& forward, const Lanes& backward) {
    return larger(load - forward, -load - backward);
  }

  /// Inlined where it pays: into the common loops.
  static constexpr bool inlines = is_common_set<Present> && !second;
  /// Of the common loops, those with bristles have corners where the cart begins to move.
  static constexpr bool may_step_by_series = inlines && may_stick<Present>;
  struct NoSeries {
    NoSeries(const PlantModel<LaneConstant>& /*model*/, const Present& /*present*/) {}
  };
  Begin begin_of(Steps& steps) const {
    if constexpr (inlines)
      return begin_of_inlined(steps);
    else
      return begin_of_called(steps);
  }
  Begin begin_of_inlined(Steps& steps) const {
    Begin begin{};
    const State& at = steps.state;
    const Lanes& motor_v = motor_of(steps);
    if (!sticks_) {
      begin.rate = frictionless_rate(at, motor_v, steps.modes.cart);
      steps.modes.cart = select(steps.settles, sign_of(begin.rate.cart_mps), steps.modes.cart);
      return begin;
    }
    const auto balance = physics_.cart_balance(at, motor_v);
    if (any(at.cart_mps == Lanes(0.0))) {
      static_cast<StaticFriction&>(begin) = everywhere_;
      settle_cart(steps, balance.load, begin);
    }
    begin.rate = physics_.derivative_by_direction(at, balance, steps.modes.cart);
    return begin;
  }
  /// The same with the rate that the stages of a step call too.
  [[gnu::flatten, gnu::noinline]] Begin begin_of_called(Steps& steps) const {
    if constexpr (second)
      if (pivot_sticks_) return begin_of_both(steps);
    Begin begin{};
    const State& at = steps.state;
    CartRate found = rate_of_cart(at, motor_of(steps), steps.modes.cart);
    if (!sticks_) {
      steps.modes.cart = select(steps.settles, sign_of(found.of.cart_mps), steps.modes.cart);
    } else if (any(at.cart_mps == Lanes(0.0))) {
      find_static_friction(at.cart_m, begin);
      settle_cart(steps, found.load_n, begin);
      if (any(steps.settles)) found = rate_of_cart(at, motor_of(steps), steps.modes.cart);
    }
    begin.rate = found.of;
    return begin;
  }

  /// Lets the load decide how carts at rest go on.
  void settle_cart(Steps& steps, const Lanes& load_n, Begin& begin) const {
    begin.excess_n = excess_of(load_n, begin.forward_n, begin.backward_n);
    const Lanes moves = select(begin.excess_n > Lanes(0.0), sign_of(load_n), Lanes(0.0));
    steps.modes.cart = select(steps.settles, moves, steps.modes.cart);
  }

  void find_static_friction(const Lanes& cart_m, StaticFriction& friction) const {
    friction.forward_n = physics_.cart_dry_level(cart_m, Lanes(0.0), Lanes(1.0));
    friction.backward_n = physics_.cart_dry_level(cart_m, Lanes(0.0), Lanes(-1.0));
  }

  /// One step in every lane that is within a period, by Taylor series.
  [[gnu::flatten, gnu::noinline]] void advance_by_series(Steps& steps) const {
    const Lanes zero(0.0);
    SeriesMotion motion(series_, steps.state, steps.drive_v);
    Lanes& mode = steps.modes.cart;
    if (any(steps.settles)) {
      const Lanes& load = motion.load_n.value;
      const Lanes excess = excess_of(load, everywhere_.forward_n, everywhere_.backward_n);
      mode = select(steps.settles, select(excess > zero, sign_of(load), zero), mode);
    }
    motion.develop(series_, steps.drive_v, mode);
    Lanes h = motion.within_sweep(smaller(steps.left_s, steps.longest_s), sweep_mps_);
    Lanes v = motion.cart_mps_after(h);
    const Lanes slowed = steps.state.cart_mps + h * motion.cart_mps2.value;
    const Lanes load = motion.load_n_after(h);
    const Lanes excess = excess_of(load, everywhere_.forward_n, everywhere_.backward_n);
    const LaneMask active = h > zero, resting = mode == zero;
    // Past a stop at the end, or with the present deceleration.
    const LaneMask stops = smaller(mode * v, mode * slowed) < zero;
    const LaneMask meets = active & (stops | (resting & (excess > zero)));
    steps.settles = active & !active;
    Lanes retry_s = zero;
    if (any(meets)) {
      const SeriesMeeting met = meeting_of(steps, motion, meets, h, load);
      h = met.length_s;
      v = select(met.stops, zero, v);
      if (any(met.slides_less)) v = select(met.slides_less, motion.cart_mps_after(h), v);
      mode = select(met.stops | met.rests, zero, select(met.breaks, sign_of(load), mode));
      const LaneMask stay = steps.taken >= Lanes(max_steps);
      steps.settles = met.stops & !stay;
      retry_s = select(met.retries, met.retry_s, zero);
      steps.taken = steps.taken + select(meets, Lanes(1.0), zero);
    }
    motion.move(steps.state, h);
    steps.state.cart_mps = v;
    steps.left_s = steps.left_s - h;
    steps.longest_s = select(retry_s > zero, retry_s, steps.left_s);
    const LaneMask next = (steps.left_s == zero) & (steps.late_s > zero);
    if (any(next)) {
      hold(steps, next, steps.late_v, steps.late_s);
      steps.late_s = select(next, zero, steps.late_s);
    }
  }

  /// What lanes that meet an event within a step of at most this length do. `load`: on the cart at its end.
  [[gnu::always_inline]] SeriesMeeting meeting_of(const Steps& steps, const SeriesMotion& motion,
                                                  const LaneMask& meets, const Lanes& longest_s,
                                                  const Lanes& load) const {
    const Lanes zero(0.0);
    const Lanes& mode = steps.modes.cart;
    const LaneMask resting = mode == zero;
    const Lanes side = sign_of(load);
    const Lanes held = select(side > zero, everywhere_.forward_n, everywhere_.backward_n);
    const LaneSeries<3>&a = motion.cart_mps2, &l = motion.load_n;
    const auto coarse_resting = CoarseLanes::narrowed(resting);
    const CoarseLanes coarse_side(side), coarse_mode(mode);
    const auto of = [&](const CoarseLanes& moving, const CoarseLanes& rest) {
      return select(coarse_resting, -(coarse_side * rest), coarse_mode * moving);
    };
    const EventPolynomial g{select(resting, larger(held - side * l.value, zero), mode * steps.state.cart_mps),
                            select(resting, -(side * l.more[0].widened()), mode * a.value),
                            of(0.5f * a.more[0], l.more[1]), of((1.0f / 3.0f) * a.more[1], l.more[2]),
                            of(0.25f * a.more[2], CoarseLanes(0.0f))};
    const EventTime event = first_zero(g, longest_s);
    const LaneMask stay = steps.taken >= Lanes(max_steps);
    SeriesMeeting met{};
    met.rests = meets & !resting & (steps.state.cart_mps == zero) & (g.slope <= zero);
    const LaneMask moves = meets & !resting & !met.rests;
    met.stops = moves & (event.found | stay);
    met.breaks = meets & resting & event.found & !stay;
    const Lanes at_s =
        select(met.breaks, smaller(event.at_s + Lanes(LaneMeeting::late_breakaway_s), longest_s), event.at_s);
    const LaneMask past = event.left < zero;
    met.retries = past & ((moves & !met.stops) | (meets & resting & !event.found & !stay));
    met.retry_s = Lanes(0.5) * event.at_s;
    met.slides_less = meets & !resting & !met.stops;
    met.length_s = select(meets & !(resting & stay), select(met.retries | met.rests, zero, at_s), longest_s);
    return met;
  }

  Begin begin_of_both(Steps& steps) const {
    Begin begin{};
    const State& at = steps.state;
    LaneModes& modes = steps.modes;
    if (sticks_ && any(at.cart_mps == Lanes(0.0))) find_static_friction(at.cart_m, begin);
    if (any(steps.settles)) {
      const auto applied = physics_.applied_forces(at, motor_of(steps), modes.cart);
      settle_contacts(physics_, at, applied, begin.forward_n, begin.backward_n, steps.settles, modes);
    }
    const Rate found = rate_of_both(at, motor_of(steps), modes);
    begin.rate = found.of;
    begin.excess_n = excess_of(found.load_n, begin.forward_n, begin.backward_n);
    begin.pivot_excess_nm = absolute(found.pivot_load_nm) - physics_.pivot_dry_level();
    // Nothing holds the cart where it reverses: it goes where it accelerates to.
    if (cart_turns_ && !sticks_)
      modes.cart =
          select(steps.settles & (at.cart_mps == Lanes(0.0)), sign_of(found.of.cart_mps), modes.cart);
    return begin;
  }

  /// The rate with these voltages in the middle and at the end of a step, whose last stage is kept.
  auto rates_of(const Steps& steps, const Lanes& middle_v, const Lanes& end_v, Step& step) const {
    return [&](const State& at, Stage stage) {
      const Rate found = rate_of(at, stage == Stage::middle ? middle_v : end_v, steps.modes);
      if (stage == Stage::end) step.last = found;
      return found.of;
    };
  }

  /// The voltages within the step give it the exact impulse; events are sought by the true accelerations at
  /// its ends.
  void step_of_lagging_motor(const Steps& steps, Step& step) const {
    const LaggedMotor<Lanes> lagged = motor_.over(steps.state.motor_v, steps.drive_v, step.length_s);
    const State first = rate_of(steps.state, lagged.begin_v, steps.modes).of;
    step.end = runge_kutta_4(rates_of(steps, lagged.middle_v, lagged.end_v, step), steps.state, first,
                             step.length_s);
    step.end.motor_v = lagged.after_v;
    step.last = rate_of(step.end, lagged.after_v, steps.modes);
  }

  /// A step, shortened to what stiff bristles need, in which their relaxation is exponential. The voltage is
  /// held: `lanes_can_run` leaves motor lags on them to the event engine.
  [[gnu::flatten, gnu::noinline]] void step_on_bristles(const Steps& steps, const Begin& begin,
                                                        Step& step) const {
    if constexpr (may_have_bristles<Present> && !second) {
      const LaneBristles bristles = bristles_of(physics_, steps.state, begin.rate, steps.modes.cart);
      const Lanes shortest = smaller(step.length_s, Lanes(shortest_on_bristles_s));
      step.length_s = larger(shortest, smaller(step.length_s, bristles.longest_s));
      const LaneRelaxation relaxation(bristles, step.length_s);
      step.end = runge_kutta_4(rates_of(steps, steps.drive_v, steps.drive_v, step), steps.state, begin.rate,
                               step.length_s, &relaxation);
    }
  }

  Rate rate_of(const State& state, const Lanes& motor_v, const LaneModes& modes) const {
    if constexpr (second) {
      if (pivot_sticks_) return rate_of_both(state, motor_v, modes);
      return {rate_of_cart(state, motor_v, modes.cart), Lanes(0.0)};
    } else {
      return rate_of_cart(state, motor_v, modes.cart);
    }
  }

  [[gnu::flatten, gnu::noinline]] BothRate rate_of_both(const State& state, const Lanes& motor_v,
                                                        const LaneModes& modes) const {
    const auto applied = physics_.applied_forces(state, motor_v, modes.cart);
    Lanes level(0.0);
    if (sticks_)
      level = physics_.cart_dry_level(state.cart_m, positive_part(modes.cart * state.cart_mps), modes.cart);
    return {{physics_.derivative_by_directions(state, applied, modes.cart, level, modes.pivot),
             physics_.cart_load(applied, modes.pivot)},
            physics_.pivot_load(applied, modes.cart, level)};
  }

  /// To the end of the period, or to where a contact that slows down would stop.
  Lanes length_of(const Steps& steps, const Begin& begin, const LaneMask& stay) const {
    Lanes longest = smaller(steps.left_s, steps.longest_s);
    if constexpr (second)
      if (motor_.lags()) longest = motor_.longest_s(steps.state.motor_v, steps.drive_v, longest);
    const Lanes length = up_to_stop(steps.modes.cart * steps.state.cart_mps,
                                    steps.modes.cart * begin.rate.cart_mps, longest, stay);
    if (!pivot_sticks()) return length;
    return up_to_stop(steps.modes.pivot * steps.state.theta_radps, steps.modes.pivot * begin.rate.theta_radps,
                      length, stay);
  }
  static Lanes up_to_stop(const Lanes& speed, const Lanes& growth, const Lanes& longest,
                          const LaneMask& stay) {
    const Lanes zero(0.0);
    const LaneMask slows = (growth < zero) & (speed > zero) & !stay;
    const Lanes stop_s = speed / select(slows, -growth, Lanes(1.0));
    return select(slows & (stop_s < longest), larger(stop_s, smaller(longest, Lanes(shortest_s))), longest);
  }

  /// Takes the step in the lanes where it met nothing, or ends at what it met. Not split: with contracted
  /// multiply-adds a split may change last digits.
  void take(Steps& steps, const Begin& begin, const Step& step, const LaneMask& stay) const {
    const Lanes zero(0.0), one(1.0), h = step.length_s;
    const LaneMask active = steps.left_s > zero;
    const Lanes per_length = select(active, one / select(active, h, one), zero);
    const auto stops_by = [&](Lanes State::*of, const Lanes& mode) {
      return stops_of(
          {mode * steps.state.*of, mode * begin.rate.*of, mode * step.end.*of, mode * step.last.of.*of}, h,
          steps.left_s - h, active, per_length);
    };
    const auto resting = [&](const Lanes& mode) { return active & (mode == zero); };
    LaneMeeting met = stops_by(&State::cart_mps, steps.modes.cart);
    if (sticks_ && any(resting(steps.modes.cart)))
      find_breakaways(resting(steps.modes.cart), begin.excess_n,
                      excess_of(step.last.load_n, begin.forward_n, begin.backward_n), h, met);
    stay_at_rest(met, stay);
    LaneMeeting pivot{};
    LaneMask stops = met.stops;
    if constexpr (second)
      if (pivot_sticks_) {
        pivot = stops_by(&State::theta_radps, steps.modes.pivot);
        if (any(resting(steps.modes.pivot)))
          find_breakaways(resting(steps.modes.pivot), begin.pivot_excess_nm,
                          absolute(step.last.pivot_load_nm) - physics_.pivot_dry_level(), h, pivot);
        stay_at_rest(pivot, stay);
        keep_first(met, pivot, h);
        stops = met.stops | pivot.stops;
      }
    const LaneMask counts = !met.beyond;
    const Lanes more = select(stops, met.to_stop_s, zero), bend = Lanes(0.5) * more * per_length;
    const auto on = [&](Lanes State::*of) {
      const Lanes first = begin.rate.*of, last = step.last.of.*of;
      steps.state.*of = select(counts, step.end.*of + more * (last + bend * (last - first)), steps.state.*of);
    };
    on(&State::cart_m);
    on(&State::theta_rad);
    on(&State::cart_mps);
    on(&State::theta_radps);
    if constexpr (may_have_bristles<Present>) on(&State::bristle_m);
    if constexpr (second)
      if (motor_.lags()) {
        const Lanes end_v = step.end.motor_v;
        const Lanes stop_v = select(stops, motor_.after(end_v, steps.drive_v, more), end_v);
        steps.state.motor_v = select(counts, stop_v, steps.state.motor_v);
      }
    const auto go_on = [&](const LaneMeeting& of, Lanes State::*velocity, Lanes& mode, const Lanes& load) {
      steps.state.*velocity = select(of.stops, zero, steps.state.*velocity);
      // Rounding may have sent a contact off against its acceleration: it rests after all.
      const LaneMask rests =
          of.stops | (of.beyond & (steps.state.*velocity == zero) & (mode * begin.rate.*velocity <= zero));
      mode = select(rests, zero, select(of.breaks, sign_of(load), mode));
    };
    go_on(met, &State::cart_mps, steps.modes.cart, step.last.load_n);
    LaneMask settles = stops;
    if constexpr (second)
      if (pivot_sticks_) {
        go_on(pivot, &State::theta_radps, steps.modes.pivot, step.last.pivot_load_nm);
        settles = settles | (met.breaks & pivot.breaks);
      }
    steps.left_s = select(counts, steps.left_s - h - more, steps.left_s);
    steps.longest_s = select(counts, steps.left_s, met.retry_s);
    steps.settles = settles & !stay;
    const Lanes met_one = select(met.beyond | stops | met.breaks, one, zero);
    steps.taken = steps.taken + (stiff_ ? met_one : one);
  }

  std::conditional_t<may_step_by_series, Dynamics<LaneConstant, Present>, NoSeries> series_;
  std::conditional_t<second, LaneMotor, PromptMotor> motor_;
  bool pivot_sticks_, cart_turns_;
  bool by_series_;               ///< in place of the classical method
  CoarseLanes sweep_mps_;        ///< change of the cart's velocity in a step by series, at most
  bool stiff_;                   ///< bristles relax too fast for the classical method
  StaticFriction everywhere_{};  ///< of the common sets, whose levels are the same at every place
};

}  // namespace upright
