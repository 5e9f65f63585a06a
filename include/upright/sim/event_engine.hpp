// The real-time engine: the classical Runge-Kutta method of order 4 with stick-slip events, for any
// scalar. With dual numbers the derivatives are correct across events: the event time is a dual number,
// from one Newton step at the root of the values, and the motion after it starts there.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "upright/model/dynamics.hpp"
#include "upright/sim/contacts.hpp"
#include "upright/sim/event_root.hpp"
#include "upright/sim/linearised_step.hpp"
#include "upright/sim/motor_lag.hpp"
#include "upright/sim/runge_kutta.hpp"

namespace upright {

/// Integrates a plant over intervals of constant voltage, or under a varying voltage. Allocates nothing
/// after construction.
template <class S>
class EventEngine {
 public:
  /// Starts at rest: call `start`.
  explicit EventEngine(const PlantModel<S>& model, const EngineOptions& options = {})
      : dynamics_(model), plain_(values_of(model)), corners_(model), options_(options) {}

  const Dynamics<S>& dynamics() const { return dynamics_; }  ///< the equations of motion

  /// Starts from a state at a time, at rest or moving, under `voltage_v` (after the input delay).
  void start(const PlantState<S>& state, double time_s = 0.0, const S& voltage_v = S(0.0)) {
    state_ = state;
    seeded_ = false;
    time_s_ = time_s;
    halted_.reset();
    event_count_ = 0;
    step_count_ = 0;
    budget_.restart(time_s);
    if (dynamics_.cart_locked()) state_.cart_mps = S(0.0);
    set_time(time_s);
    hold(voltage_v);
    contacts_ = contacts_of(plain_state(state_));
    settle();
  }

  /// Advances by `duration_s` with constant `voltage_v` (after the input delay). Has no effect once
  /// halted.
  void advance(const S& duration_s, const S& voltage_v) {
    hold(voltage_v);
    settle();
    halt_where_ended();
    S remaining = duration_s;
    while (value_of(remaining) > 0.0 && !halted_) {
      ++step_count_;
      const bool held = budget_.spent(time_s_);
      BeginRate<double> plain_begin = update_bristle_step_limit(value_of(state_.motor_v));
      const S step = next_step(remaining);
      set_time(time_s_ + 0.5 * value_of(step));
      const bool quick = linearises_in_middle();
      BeginRate<S> begin;
      if constexpr (std::is_same_v<S, double>) begin = plain_begin;
      PlantState<S> next{};
      if (!quick) next = rk4(dynamics_, state_, drive_, step, &begin);
      if constexpr (std::is_same_v<S, double>) plain_begin = begin;
      const PlantState<double> plain_next =
          quick ? rk4(plain_, plain_state(state_), value_of(drive_), value_of(step), &plain_begin)
                : plain_state(next);
      const PlantState<double> rate = quick ? *plain_begin : plain_state(*begin);
      const auto along = [&](double t) {
        return rk4(plain_, plain_state(state_), value_of(drive_), t, &plain_begin);
      };
      const auto found = first_event(plain_next, rate, value_of(step), held, along);
      if (!found) {
        if (!quick) state_ = next;
        if constexpr (!std::is_same_v<S, double>)
          if (quick) linearised().take(plain_next, step, voltage_over(step), seeded_, state_);
        seeded_ = false;
        remaining = remaining - step;
        time_s_ += value_of(step);
        continue;
      }
      remaining = remaining - pass(*found, held, begin);
    }
  }

  /// Advances under the first of some voltages that are held in turn, as many as one step may span (dual
  /// numbers with quick derivatives only). The values are those of `advance` for each, the derivatives those
  /// of one step under the mean voltage. Returns how many voltages have passed: 0, with nothing changed, if
  /// fewer than two fit into a step, or if they meet an event.
  std::size_t advance_in_one_step(const HeldVoltage<S>* held,
                                  std::size_t count) requires(!std::is_same_v<S, double>) {
    if (!linearises_in_middle() || halted_ || budget_.spent(time_s_)) return 0;
    constexpr double slack = 1e-9;  // sums of times are rounded
    const double rate = motion_rate(), limit_s = rate_step(rate) * (1.0 + slack);
    std::size_t spanned = 0;
    S duration_s(0.0);
    while (spanned < count && value_of(duration_s) + value_of(held[spanned].duration_s) <= limit_s)
      duration_s += held[spanned++].duration_s;
    if (spanned < 2) return 0;
    const PlantState<S> begin = state_;
    const S drive_before = drive_;
    set_time(time_s_ + 0.5 * value_of(duration_s));
    S impulse_vs(0.0), moment_vs2(0.0), left_s(value_of(duration_s));  // of a step of this length
    for (std::size_t i = 0; i < spanned; ++i) {
      const S& h = held[i].duration_s;
      const double length_s = value_of(h);
      hold(S(held[i].voltage_v));
      if (length_s > rate_step(with_lag(rate)) || !step_plainly(length_s)) {
        state_ = begin;
        drive_ = drive_before;
        return 0;
      }
      const StepVoltage<S> voltage = voltage_over(h);
      const S within_s = i + 1 < spanned ? h : left_s;
      const S longer_s = within_s - S(length_s);
      const S part_vs = voltage.mean_v * S(length_s) + voltage.end_v * longer_s;
      impulse_vs += part_vs;
      moment_vs2 += part_vs * (left_s - S(0.5) * within_s) + voltage.moment_vs2 -
                    S(0.5 * length_s) * (voltage.end_v - voltage.mean_v) * longer_s;
      left_s -= within_s;
      state_.motor_v = voltage.end_v;
    }
    const PlantState<double> end = plain_state(state_);
    const double whole_s = value_of(duration_s);
    const StepVoltage<S> voltage{impulse_vs / S(whole_s), state_.motor_v,
                                 S(moment_vs2 - S(0.5 * whole_s) * impulse_vs)};
    state_ = begin;
    linearised().take(end, duration_s, voltage, seeded_, state_);
    seeded_ = false;
    time_s_ += whole_s;
    step_count_ += spanned;
    return spanned;
  }

  /// Advances by `duration_s` under a varying voltage: `volts(t, state)` is the command (after the input
  /// delay) at time t, smooth between events. Steps are at most `max_step_s`; `sink(const DenseStep&)`
  /// receives each step before the next begins. Motor lags below a microsecond are neglected here.
  template <class Volts, class Sink>
  requires(std::is_same_v<S, double>&& std::is_invocable_r_v<
           double, Volts, double, const PlantState<double>&>) void advance(double duration_s,
                                                                           const Volts& volts,
                                                                           double max_step_s,
                                                                           const Sink& sink) {
    const bool lag = dynamics_.has_motor_lag() && dynamics_.motor_time_constant_s() > min_lag_s;
    const auto command = [&](double t, const PlantState<double>& s) { return volts(t, s); };
    if (!lag) state_.motor_v = dynamics_.actuate(command(time_s_, state_));
    settle();
    halt_where_ended();
    const double end_s = time_s_ + duration_s;
    while (!halted_ && end_s - time_s_ > smallest_step_s) {
      ++step_count_;
      const bool held = budget_.spent(time_s_);
      update_bristle_step_limit(lag ? state_.motor_v : plain_.actuate(command(time_s_, state_)));
      double rate = motion_rate();
      if (lag) rate += 1.0 / dynamics_.motor_time_constant_s();
      const double step = even_step(end_s - time_s_, std::min(rate_step(rate), max_step_s));
      set_time(time_s_ + 0.5 * step);
      const auto along = [&](double t) { return driven_rk4(command, lag, t).end; };
      const DrivenStep driven = driven_rk4(command, lag, step);
      auto found = first_event(driven.end, driven.first, step, held, along);
      WatchList corner_list;
      corners_.watch(command(time_s_, state_), corner_list);
      for (const Watch& watch : corner_list) {
        const auto past = [&](double t, const PlantState<double>& s) {
          return watch.sign * (command(time_s_ + t, s) - watch.corner_v);
        };
        const double at_end = past(step, driven.end);
        if (!(at_end > 0.0)) continue;
        const double after =
            turning_positive([&](double t) { return past(t, along(t)); }, past(0.0, state_), at_end, step);
        if (!found || after < found->after_s) found = Found{watch, after};
      }
      if (found && found->watch.kind == EventKind::actuator_corner && found->after_s < smallest_step_s)
        found.reset();
      const DrivenStep taken = found ? driven_rk4(command, lag, found->after_s) : driven;
      const double to_s = found ? time_s_ + found->after_s : time_s_ + step;
      if (to_s > time_s_) {
        DenseStep dense = dense_step(taken, command, lag, to_s);
        mark_end(dense, found ? &found->watch : nullptr);
        sink(dense);
      }
      state_ = taken.end;
      time_s_ = to_s;
      if (found) enter(found->watch, held);
      if (!lag) state_.motor_v = dynamics_.actuate(command(time_s_, state_));
    }
    if (!halted_) time_s_ = end_s;
  }

  const PlantState<S>& state() const { return state_; }             ///< the state now
  Outputs<S> outputs() const { return dynamics_.measure(state_); }  ///< what the sensors show now
  /// Replaces the present state: its derivatives, for callers that propagate sensitivities themselves, or
  /// its values too, for observers that correct it. A sticking contact keeps sticking as long as its
  /// velocity is zero.
  void correct(const PlantState<S>& state) {
    state_ = state;
    seeded_ = false;
    if (value_of(state.cart_mps) != 0.0) contacts_.cart = direction_of(value_of(state.cart_mps));
    if (value_of(state.theta_radps) != 0.0) contacts_.pivot = direction_of(value_of(state.theta_radps));
  }
  /// Replaces the derivatives of the state (dual numbers only) by the identity, in the order x, theta, v,
  /// omega, bristle, and an attached mass if there is one; no parameter may use these places. What cannot
  /// move has none, nor has the velocity of a sticking contact, where an impulse has no effect.
  void seed() requires(!std::is_same_v<S, double>) {
    const bool cart = !dynamics_.cart_locked(), pendulum = dynamics_.has_pendulum();
    const auto set = [](S& number, int place, bool moves) {
      number.v = {};
      if (moves) number.v.set(place, 1.0);
    };
    set(state_.cart_m, 0, cart);
    set(state_.theta_rad, 1, pendulum);
    set(state_.cart_mps, 2, cart && !cart_at_rest());
    set(state_.theta_radps, 3, pendulum && !pivot_at_rest());
    set(state_.bristle_m, 4, dynamics_.has_bristle_state());
    set(state_.attached_m, 5, dynamics_.has_attached_mass());
    set(state_.attached_mps, 6, dynamics_.has_attached_mass());
    seeded_ = true;
  }
  Contacts contacts() const { return contacts_; }  ///< the modes of the contacts now
  double time_s() const { return time_s_; }        ///< the time now [s]
  /// Whether dry friction holds the cart.
  bool cart_at_rest() const { return dynamics_.cart_can_stick() && contacts_.cart == Contact::stick; }
  /// Whether dry friction holds the pendulum.
  bool pivot_at_rest() const { return dynamics_.pivot_can_stick() && contacts_.pivot == Contact::stick; }
  /// The event that halted the engine: fall or track_end.
  std::optional<EventKind> halted() const { return halted_; }

  /// The number of events since `start`, and the latest of them (a ring of `kept_events`).
  std::uint64_t event_count() const { return event_count_; }
  /// One of the last `kept_events` events.
  const Event& event(std::uint64_t index) const { return events_[index % kept_events]; }
  static constexpr std::uint64_t kept_events = 256;  ///< how many events are kept
  /// Steps since `start`, a measure of computing time.
  std::uint64_t step_count() const { return step_count_; }

 private:
  static constexpr MotorVoltage held_voltage = MotorVoltage::held, moving_voltage = MotorVoltage::moves;
  static constexpr AttachedStates mass = AttachedStates::possible;
  static constexpr double min_lag_s = 1e-6, smallest_step_s = 1e-13, max_rate_radps = 2e6;

  struct Found {
    Watch watch;
    double after_s;
  };

  /// The rate at the beginning of a step, once it is known.
  template <class T>
  using BeginRate = std::optional<PlantState<T>>;

  /// What changes during a run stays the same within a step: it has the value of the middle.
  void set_time(double time_s) {
    dynamics_.set_time(time_s);
    plain_.set_time(time_s);
  }

  void hold(const S& voltage_v) {
    drive_ = dynamics_.actuate(voltage_v);
    if (!dynamics_.has_motor_lag()) state_.motor_v = drive_;
  }

  void settle() { contacts_ = settled_contacts(plain_, plain_state(state_), contacts_); }

  void halt_where_ended() {
    const auto end =
        ended_at(value_of(state_.theta_rad), value_of(state_.cart_m), dynamics_.has_pendulum(), options_);
    if (!end || halted_) return;
    halted_ = end;
    note(*end);
  }

  void note(EventKind kind) {
    events_[event_count_++ % kept_events] = {time_s_, kind};
    budget_.count();
  }

  /// The initial rate of the bristles, and the greatest rate that a step must resolve: their approach to
  /// the steady deflection, the relaxation, and the cart's oscillation on their stiffness, which a fast
  /// relaxation overdamps. Returns the rate of the present state, if it was needed.
  BeginRate<double> update_bristle_step_limit(double motor_v) {
    if (!dynamics_.has_bristle_state()) return std::nullopt;
    const PlantState<double> s = plain_state(state_);
    const PlantState<double> rate = plain_.derivative(s, motor_v, contacts_);
    const double relaxation = plain_.bristle_relaxation_radps(s);
    constexpr double aside_s = 1e-7;
    const double growth = (plain_.bristle_relaxation_radps(moved(s, rate, aside_s)) - relaxation) / aside_s;
    const double way = s.cart_mps == 0.0 ? 0.0 : std::abs(rate.bristle_m / s.cart_mps);
    const double change = std::abs(growth);
    const PlantState<double> push = plain_.push(s, contacts_);
    const double damping = plain_.bristle_damping(), slowed = damping * push.cart_mps;
    const double spring = plain_.bristle_stiffness() * push.cart_mps;
    const double oscillation = std::sqrt(spring), creep = spring / std::max(relaxation + slowed, 1.0);
    // A margin against cancellation: a cart that damping holds against its bristles moves by small
    // differences of large numbers.
    constexpr double of_damping = 0.05;
    const double on_stiffness =
        options_.resolve_bristles ? oscillation + slowed : std::min(oscillation, creep) + of_damping * slowed;
    bristle_change_radps_ = std::min(way, 1.0) * relaxation +
                            std::min(std::sqrt(change), change / std::max(relaxation, 1.0)) + on_stiffness;
    bristles_ = {relaxation + slowed, rate.cart_mps + slowed * rate.bristle_m - growth * s.bristle_m, slowed,
                 damping * push.theta_radps};
    return rate;
  }

  /// Greatest rate of the motion itself, bounded so that no plant causes unbounded work.
  double motion_rate() const {
    const double rate = plain_.fastest_rate_radps(plain_state(state_), false) + bristle_change_radps_;
    return std::min(rate, max_rate_radps);
  }

  double rate_step(double rate) const {
    return std::clamp(options_.step_fraction / rate, options_.min_step_s, options_.max_step_s);
  }

  S next_step(const S& remaining) const { return even_step(remaining, rate_step(with_lag(motion_rate()))); }

  /// A rate of motion, and that of a lagging motor where its voltage changes.
  double with_lag(double rate) const {
    if (!dynamics_.has_motor_lag() || !options_.resolve_lag) return rate;
    const double gap_v = std::abs(value_of(drive_) - value_of(state_.motor_v));
    constexpr double settled_v = 1e-9;
    if (gap_v <= settled_v) return rate;
    // A lag shorter than the shortest step has settled within it.
    return std::min(rate + options_.step_fraction / value_of(dynamics_.motor_time_constant_s()),
                    max_rate_radps);
  }

  /// The motor's lag over a step of length h from `motor_v`.
  template <class T>
  static LaggedMotor<T> lagged_motor(const Dynamics<T>& dynamics, const T& motor_v, const T& drive,
                                     const T& h) {
    const T r = h / dynamics.motor_time_constant_s();
    return value_of(r) < smooth_within_lags ? slowly_lagged_motor(motor_v, drive, r)
                                            : quickly_lagged_motor(motor_v, drive, r);
  }

  template <class T>
  std::optional<Relaxation<T>> relaxation_over(const T& h) const {
    if (!dynamics_.has_bristle_state()) return std::nullopt;
    return Relaxation<T>(bristles_, h);
  }

  /// One step under constant drive. `begin`: the rate at its beginning, which is computed once for all step
  /// lengths; a lagging motor's depends on the length.
  template <class T>
  PlantState<T> rk4(const Dynamics<T>& dynamics, const PlantState<T>& s, const T& drive, const T& h,
                    BeginRate<T>* begin = nullptr) const {
    std::optional<LaggedMotor<T>> lagged;
    if (dynamics.has_motor_lag()) lagged.emplace(lagged_motor(dynamics, s.motor_v, drive, h));
    const T& begin_v = lagged ? lagged->begin_v : drive;
    const T& middle_v = lagged ? lagged->middle_v : drive;
    const T& end_v = lagged ? lagged->end_v : drive;
    const auto rate = [&](const PlantState<T>& at, Stage stage) {
      return dynamics.derivative(at, stage == Stage::middle ? middle_v : end_v, contacts_);
    };
    const bool known = begin != nullptr && begin->has_value() && !lagged;
    const PlantState<T> k1 = known ? **begin : dynamics.derivative(s, begin_v, contacts_);
    if (begin != nullptr) *begin = k1;
    const std::optional<Relaxation<T>> bristles = relaxation_over(h);
    PlantState<T> end = runge_kutta_4<held_voltage, mass>(rate, s, k1, h, bristles ? &*bristles : nullptr);
    end.motor_v = lagged ? lagged->after_v : drive;
    return end;
  }

  bool linearises_in_middle() const {
    if (dynamics_.has_bristle_state() || dynamics_.has_attached_mass() || dynamics_.loses_counts())
      return false;
    return !std::is_same_v<S, double> && options_.quick_derivatives;
  }

  LinearisedStep<S> linearised() const {
    const bool cart_moves = !dynamics_.cart_locked() && !cart_at_rest();
    const bool pivot_moves = dynamics_.has_pendulum() && !pivot_at_rest();
    return {dynamics_, plain_, contacts_, cart_moves, pivot_moves};
  }

  /// Of one voltage that is held.
  StepVoltage<S> voltage_over(const S& h) const {
    if (!dynamics_.has_motor_lag()) return {drive_, drive_};
    return lagged_voltage(state_.motor_v, drive_, dynamics_.motor_time_constant_s(), h);
  }

  /// One step of the values of the coordinates under the present drive, without derivatives. False, with
  /// nothing changed, if that meets an event.
  bool step_plainly(double h) requires(!std::is_same_v<S, double>) {
    const Contacts settled = settled_contacts(plain_, plain_state(state_), contacts_);
    if (settled.cart != contacts_.cart || settled.pivot != contacts_.pivot) return false;
    BeginRate<double> begin;
    const auto along = [&](double t) {
      return rk4(plain_, plain_state(state_), value_of(drive_), t, &begin);
    };
    const PlantState<double> end = along(h);
    bool meets_event = false;
    visit_events(end, *begin, h, false, along, [&](const Watch&, double, double) { meets_event = true; });
    if (meets_event) return false;
    state_.cart_m.a = end.cart_m;
    state_.theta_rad.a = end.theta_rad;
    state_.cart_mps.a = end.cart_mps;
    state_.theta_radps.a = end.theta_radps;
    return true;
  }

  struct DrivenStep {
    PlantState<double> first;  ///< rate at the beginning
    PlantState<double> end;
  };

  /// Rate of the state under a varying command, including the motor's lag.
  template <class Command>
  PlantState<double> driven_rate(const Command& command, bool lag, double t,
                                 const PlantState<double>& s) const {
    const double drive = plain_.actuate(command(t, s));
    PlantState<double> rate = plain_.derivative(s, lag ? s.motor_v : drive, contacts_);
    rate.motor_v = lag ? (drive - s.motor_v) / plain_.motor_time_constant_s() : 0.0;
    return rate;
  }

  template <class Command>
  DrivenStep driven_rk4(const Command& command, bool lag, double h) const {
    const auto rate = [&](const PlantState<double>& at, Stage stage) {
      return driven_rate(command, lag, time_s_ + (stage == Stage::middle ? 0.5 * h : h), at);
    };
    const PlantState<double> s = plain_state(state_);
    DrivenStep step{driven_rate(command, lag, time_s_, s), {}};
    const std::optional<Relaxation<double>> bristles = relaxation_over(h);
    step.end = runge_kutta_4<moving_voltage, mass>(rate, s, step.first, h, bristles ? &*bristles : nullptr);
    if (!lag) step.end.motor_v = plain_.actuate(command(time_s_ + h, step.end));
    return step;
  }

  /// The Hermite cubic through the states and rates at both ends of the step from now to `to_s`.
  template <class Command>
  DenseStep dense_step(const DrivenStep& step, const Command& command, bool lag, double to_s) const {
    const PlantState<double> last = driven_rate(command, lag, to_s, step.end);
    const double h = to_s - time_s_;
    DenseStep dense;
    dense.begin_s = dense.at_s = time_s_;
    dense.end_s = to_s;
    dense.factors = 4;
    const auto cubic = [&](double PlantState<double>::*of) {
      const double rise = (step.end.*of - state_.*of) / h;
      dense.factor[0].*of = state_.*of;
      dense.factor[1].*of = step.first.*of;
      dense.factor[2].*of = (3.0 * rise - 2.0 * (step.first.*of) - last.*of) / h;
      dense.factor[3].*of = (step.first.*of + last.*of - 2.0 * rise) / (h * h);
    };
    using Plain = PlantState<double>;
    for (double Plain::*of : {&Plain::cart_m, &Plain::theta_rad, &Plain::cart_mps, &Plain::theta_radps,
                              &Plain::motor_v, &Plain::bristle_m, &Plain::attached_m, &Plain::attached_mps})
      cubic(of);
    return dense;
  }

  /// Calls `visit(watch, within_s, at_end)` for each event within a step that ends at `end`: it is between
  /// the beginning and `within_s`, where its indicator is `at_end` > 0. `rate` is that at the beginning,
  /// `along(t)` the state at a time within the step.
  template <class Along, class Visit>
  void visit_events(const PlantState<double>& end, const PlantState<double>& rate, double h, bool held,
                    const Along& along, const Visit& visit) const {
    const double v = value_of(state_.cart_mps), omega = value_of(state_.theta_radps);
    for (const Watch& watch : next_events(plain_, v, omega, contacts_, options_, held)) {
      const double at_end = event_indicator(plain_, end, contacts_, watch, options_);
      if (at_end > 0.0) {
        visit(watch, h, at_end);
        continue;
      }
      const bool cart = watch.kind == EventKind::cart_stick || watch.kind == EventKind::cart_reversal;
      const bool pivot = watch.kind == EventKind::pivot_stick || watch.kind == EventKind::pivot_reversal;
      if (!cart && !pivot) continue;
      // The velocity may change sign twice within the step.
      const double from = watch.sign * (cart ? v : omega);
      const double slope = watch.sign * (cart ? rate.cart_mps : rate.theta_radps);
      if (!(from > 0.0 && from + 0.5 * h * slope <= 0.0)) continue;
      const double curvature = (-at_end - from - slope * h) / (h * h);
      const double lowest_s = -slope / (2.0 * curvature);
      if (!(lowest_s > 0.0 && lowest_s < h)) continue;
      const double at_lowest = event_indicator(plain_, along(lowest_s), contacts_, watch, options_);
      if (at_lowest > 0.0) visit(watch, lowest_s, at_lowest);
    }
  }

  /// The first of them.
  template <class Along>
  std::optional<Found> first_event(const PlantState<double>& end, const PlantState<double>& rate, double h,
                                   bool held, const Along& along) const {
    std::optional<Found> first;
    visit_events(end, rate, h, held, along, [&](const Watch& watch, double within_s, double at_end) {
      const double after_s = time_of_event(watch, rate, within_s, at_end, along);
      if (!first || after_s < first->after_s) first = Found{watch, after_s};
    });
    return first;
  }

  template <class Along>
  double time_of_event(const Watch& watch, const PlantState<double>& rate, double within_s, double at_end,
                       const Along& along) const {
    const auto f = [&](double t) { return event_indicator(plain_, along(t), contacts_, watch, options_); };
    const PlantState<double> begin = plain_state(state_);
    const double now = event_indicator(plain_, begin, contacts_, watch, options_);
    if (now < 0.0 && linearises_in_middle()) {
      const auto with_slope = [&](double t) {
        const PlantState<double> at = along(t);
        return indicator_with_slope(watch, at, plain_.derivative(at, at.motor_v, contacts_));
      };
      const double slope_per_s = indicator_with_slope(watch, begin, rate).slope_per_s;
      const double guess_s = first_guess(now, slope_per_s, at_end, within_s);
      if (const auto root = newton_root(with_slope, guess_s, within_s, options_.event_tolerance_s))
        return *root;
    }
    return turning_positive(f, now, at_end, within_s, options_.event_tolerance_s);
  }

  /// A state a little later, at this rate, under the present drive.
  template <class T>
  PlantState<T> moved_on(const Dynamics<T>& dynamics, const PlantState<T>& at, const PlantState<T>& rate,
                         const T& drive, const T& shift_s) const {
    PlantState<T> to = moved<held_voltage, mass>(at, rate, shift_s);
    if (dynamics.has_motor_lag())
      to.motor_v = at.motor_v + shift_s * (drive - at.motor_v) / dynamics.motor_time_constant_s();
    return to;
  }

  /// An indicator in a state that changes at this rate.
  IndicatorSlope indicator_with_slope(const Watch& watch, const PlantState<double>& at,
                                      const PlantState<double>& rate) const {
    constexpr double aside_s = 1e-7;
    const PlantState<double> aside = moved_on(plain_, at, rate, value_of(drive_), aside_s);
    const double value = event_indicator(plain_, at, contacts_, watch, options_);
    return {value, (event_indicator(plain_, aside, contacts_, watch, options_) - value) / aside_s};
  }

  /// Advances to an event and through it. Returns the elapsed time with its derivative.
  S pass(const Found& found, bool held, BeginRate<S>& begin) {
    S taken(found.after_s);
    state_ = moved_to(taken, begin);
    if constexpr (!std::is_same_v<S, double>) {
      const PlantState<S> rate = dynamics_.derivative(state_, state_.motor_v, contacts_);
      // The root depends on the parameters: dt = -dg / (dg/dt).
      const S g = event_indicator(dynamics_, state_, contacts_, found.watch, options_);
      const double slope =
          indicator_with_slope(found.watch, plain_state(state_), plain_state(rate)).slope_per_s;
      constexpr double flattest = 1e-9;  // a grazing event has no derivative; keep it finite
      const S shift = (S(value_of(g)) - g) / S(std::max(slope, flattest));
      state_ = moved_on(dynamics_, state_, rate, drive_, shift);
      taken = taken + shift;
    }
    seeded_ = false;
    time_s_ += found.after_s;
    enter(found.watch, held);
    return taken;
  }

  /// The present state after `taken`, without an event.
  PlantState<S> moved_to(const S& taken, BeginRate<S>& begin) const {
    // Over a much shorter step the mean of a lagging voltage is a difference of nearly equal numbers.
    constexpr double min_quick_s = 1e-7;
    if constexpr (!std::is_same_v<S, double>) {
      if (linearises_in_middle() && value_of(taken) > min_quick_s) {
        PlantState<S> at = state_;
        const PlantState<double> plain_at =
            rk4(plain_, plain_state(state_), value_of(drive_), value_of(taken));
        linearised().take(plain_at, taken, voltage_over(taken), seeded_, at);
        return at;
      }
    }
    return rk4(dynamics_, state_, drive_, taken, &begin);
  }

  /// Changes the contact modes for an event at the present state.
  void enter(const Watch& watch, bool held) {
    const EventKind kind = watch.kind;
    if (kind == EventKind::actuator_corner) return;
    if (kind == EventKind::cart_reversal || kind == EventKind::cart_stick) state_.cart_mps = S(0.0);
    if (kind == EventKind::pivot_reversal || kind == EventKind::pivot_stick) state_.theta_radps = S(0.0);
    contacts_ = contacts_after(plain_, plain_state(state_), contacts_, kind, held);
    if (kind == EventKind::fall || kind == EventKind::track_end) halted_ = kind;
    note(resolved_kind(kind, contacts_));
  }

  Dynamics<S> dynamics_;
  Dynamics<double> plain_;
  ActuatorCorners<S> corners_;
  EngineOptions options_;
  PlantState<S> state_{};
  bool seeded_ = false;  ///< the derivatives of the state are the identity
  Contacts contacts_;
  S drive_{};
  Bristles bristles_;                  ///< at the beginning of this step
  double bristle_change_radps_ = 0.0;  ///< the greatest rate of theirs that steps must resolve
  double time_s_ = 0.0;
  std::optional<EventKind> halted_;
  EventBudget budget_;
  std::uint64_t event_count_ = 0;
  std::uint64_t step_count_ = 0;
  std::array<Event, kept_events> events_{};
};

}  // namespace upright
