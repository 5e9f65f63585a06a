// The real-time engine: classical Runge-Kutta of order 4 with true stick-slip events, for any scalar. With
// dual numbers the derivatives are right across events: the time of an event is itself a dual number, found
// by one Newton step from the plain root, and the motion after it starts from there.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "upright/model/dynamics.hpp"

namespace upright {

enum class EventKind : std::uint8_t {
  cart_stick,
  cart_breakaway,
  cart_reversal,
  pivot_stick,
  pivot_breakaway,
  pivot_reversal,
  fall,
  track_end,
};

struct Event {
  double time_s = 0.0;
  EventKind kind = EventKind::cart_stick;
};

struct EngineOptions {
  double max_step_s = 1e-3;
  /// Steps are at most this fraction of the inverse of the fastest rate of the motion.
  double step_fraction = 0.2;
  std::optional<double> fall_angle_rad;  ///< the run halts where |theta| reaches it
  std::optional<double> track_limit_m;   ///< the run halts where |x| reaches it
};

/// Integrates a plant over intervals of constant voltage. Allocates nothing after construction.
template <class S>
class EventEngine {
 public:
  explicit EventEngine(const PlantModel<S>& model, const EngineOptions& options = {})
      : dynamics_(model), plain_(values_of(model)), options_(options) {}

  const Dynamics<S>& dynamics() const { return dynamics_; }

  /// Starts from a state at a time, at rest or moving, under `voltage_v` (after the input delay).
  void start(const PlantState<S>& state, double time_s = 0.0, const S& voltage_v = S(0.0)) {
    state_ = state;
    time_s_ = time_s;
    halted_.reset();
    event_count_ = 0;
    if (dynamics_.cart_locked()) state_.cart_mps = S(0.0);
    drive_ = dynamics_.actuate(voltage_v);
    if (!dynamics_.has_motor_lag()) state_.motor_v = drive_;
    contacts_.cart = direction_of(value_of(state_.cart_mps));
    contacts_.pivot = direction_of(value_of(state_.theta_radps));
    settle();
  }

  /// Moves on by `duration_s` with the voltage (after the input delay) held at `voltage_v`. Does nothing once
  /// halted.
  void advance(const S& duration_s, const S& voltage_v) {
    drive_ = dynamics_.actuate(voltage_v);
    if (!dynamics_.has_motor_lag()) state_.motor_v = drive_;
    settle();
    S remaining = duration_s;
    int events_left = most_events_per_advance;
    while (value_of(remaining) > 0.0 && !halted_) {
      const S step = next_step(remaining);
      const PlantState<S> next = rk4(dynamics_, state_, contacts_, drive_, step);
      const auto found = events_left > 0 ? first_event(plain_state(next), value_of(step)) : std::nullopt;
      if (!found) {
        state_ = next;
        remaining = remaining - step;
        time_s_ += value_of(step);
        continue;
      }
      --events_left;
      remaining = remaining - pass(*found);
    }
  }

  const PlantState<S>& state() const { return state_; }
  Outputs<S> outputs() const { return dynamics_.measure(state_); }
  Contacts contacts() const { return contacts_; }
  double time_s() const { return time_s_; }
  bool cart_at_rest() const { return dynamics_.cart_can_stick() && contacts_.cart == Contact::stick; }
  /// Why the run halted: fall or track_end.
  std::optional<EventKind> halted() const { return halted_; }

  /// Events since `start`: how many, and the latest of them (a ring of `kept_events`).
  std::uint64_t event_count() const { return event_count_; }
  const Event& event(std::uint64_t index) const { return events_[index % kept_events]; }
  static constexpr std::uint64_t kept_events = 256;

 private:
  static constexpr int most_events_per_advance = 1000;
  static constexpr int most_root_iterations = 60;
  static constexpr double root_tolerance_s = 1e-14;

  struct Found {
    EventKind kind;
    double after_s;
  };

  static Contact direction_of(double velocity) {
    if (velocity == 0.0) return Contact::stick;
    return velocity > 0.0 ? Contact::slip_forward : Contact::slip_backward;
  }

  static PlantState<double> plain_state(const PlantState<S>& s) {
    return {value_of(s.cart_m),      value_of(s.theta_rad), value_of(s.cart_mps),
            value_of(s.theta_radps), value_of(s.motor_v),   value_of(s.bristle_m)};
  }

  S next_step(const S& remaining) const {
    double rate = plain_.fastest_rate_radps(plain_state(state_));
    if (dynamics_.has_motor_lag()) {
      const double gap_v = std::abs(value_of(drive_) - value_of(state_.motor_v));
      constexpr double settled_v = 1e-9;
      if (gap_v > settled_v) rate += 1.0 / value_of(dynamics_.motor_time_constant_s());
    }
    const double limit = std::min(options_.max_step_s, options_.step_fraction / rate);
    const double pieces = std::ceil(value_of(remaining) / limit - 1e-9);
    return pieces <= 1.0 ? remaining : S(remaining / S(pieces));
  }

  template <class T>
  static PlantState<T> shifted(const PlantState<T>& s, const PlantState<T>& rate, const T& h) {
    return {s.cart_m + h * rate.cart_m,
            s.theta_rad + h * rate.theta_rad,
            s.cart_mps + h * rate.cart_mps,
            s.theta_radps + h * rate.theta_radps,
            s.motor_v,
            s.bristle_m + h * rate.bristle_m};
  }

  template <class T>
  static PlantState<T> rk4(const Dynamics<T>& dynamics, const PlantState<T>& s, Contacts contacts,
                           const T& drive, const T& h) {
    const T half = T(0.5) * h;
    T middle_v = drive;
    T end_v = drive;
    if (dynamics.has_motor_lag()) {
      using std::exp;
      const T decay = exp(-half / dynamics.motor_time_constant_s());
      middle_v = drive + (s.motor_v - drive) * decay;
      end_v = drive + (s.motor_v - drive) * decay * decay;
    }
    const PlantState<T> k1 = dynamics.derivative(s, s.motor_v, contacts);
    const PlantState<T> k2 = dynamics.derivative(shifted(s, k1, half), middle_v, contacts);
    const PlantState<T> k3 = dynamics.derivative(shifted(s, k2, half), middle_v, contacts);
    const PlantState<T> k4 = dynamics.derivative(shifted(s, k3, h), end_v, contacts);
    const T sixth = h / T(6.0);
    const auto mean = [](const T& a, const T& b, const T& c, const T& d) { return a + T(2.0) * (b + c) + d; };
    PlantState<T> end;
    end.cart_m = s.cart_m + sixth * mean(k1.cart_m, k2.cart_m, k3.cart_m, k4.cart_m);
    end.theta_rad = s.theta_rad + sixth * mean(k1.theta_rad, k2.theta_rad, k3.theta_rad, k4.theta_rad);
    end.cart_mps = s.cart_mps + sixth * mean(k1.cart_mps, k2.cart_mps, k3.cart_mps, k4.cart_mps);
    end.theta_radps =
        s.theta_radps + sixth * mean(k1.theta_radps, k2.theta_radps, k3.theta_radps, k4.theta_radps);
    end.bristle_m = s.bristle_m + sixth * mean(k1.bristle_m, k2.bristle_m, k3.bristle_m, k4.bristle_m);
    end.motor_v = end_v;
    return end;
  }

  PlantState<double> plain_step(double h) const {
    return rk4(plain_, plain_state(state_), contacts_, value_of(drive_), h);
  }

  /// A function of the state that is not positive before its event and positive after it.
  template <class T>
  T indicator(const Dynamics<T>& dynamics, const PlantState<T>& s, EventKind kind) const {
    switch (kind) {
      case EventKind::cart_stick:
        return -T(static_cast<double>(contacts_.cart)) * s.cart_mps;
      case EventKind::pivot_stick:
        return -T(static_cast<double>(contacts_.pivot)) * s.theta_radps;
      case EventKind::cart_reversal:
        return value_of(state_.cart_mps) > 0.0 ? T(-s.cart_mps) : s.cart_mps;
      case EventKind::pivot_reversal:
        return value_of(state_.theta_radps) > 0.0 ? T(-s.theta_radps) : s.theta_radps;
      case EventKind::cart_breakaway: {
        const T load = dynamics.cart_load(s, s.motor_v, contacts_.pivot);
        const T forward = load - dynamics.cart_dry_level(s.cart_m, T(0.0), T(1.0));
        const T backward = -load - dynamics.cart_dry_level(s.cart_m, T(0.0), T(-1.0));
        return forward > backward ? forward : backward;
      }
      case EventKind::pivot_breakaway:
        return absolute(dynamics.pivot_load(s, s.motor_v, contacts_.cart)) - dynamics.pivot_dry_level();
      case EventKind::fall:
        return absolute(s.theta_rad) - T(*options_.fall_angle_rad);
      case EventKind::track_end:
        return absolute(s.cart_m) - T(*options_.track_limit_m);
    }
    return T(-1.0);
  }

  std::optional<Found> first_event(const PlantState<double>& end, double h) const {
    std::optional<Found> first;
    const auto consider = [&](EventKind kind) {
      if (!(indicator(plain_, end, kind) > 0.0)) return;
      const double after = root(kind, h);
      if (!first || after < first->after_s) first = Found{kind, after};
    };
    if (!dynamics_.cart_locked() && dynamics_.cart_has_kink()) {
      if (!dynamics_.cart_can_stick()) {
        if (value_of(state_.cart_mps) != 0.0) consider(EventKind::cart_reversal);
      } else {
        consider(contacts_.cart == Contact::stick ? EventKind::cart_breakaway : EventKind::cart_stick);
      }
    }
    if (dynamics_.pivot_has_kink()) {
      if (!dynamics_.pivot_can_stick()) {
        if (value_of(state_.theta_radps) != 0.0) consider(EventKind::pivot_reversal);
      } else {
        consider(contacts_.pivot == Contact::stick ? EventKind::pivot_breakaway : EventKind::pivot_stick);
      }
    }
    if (options_.fall_angle_rad && dynamics_.has_pendulum()) consider(EventKind::fall);
    if (options_.track_limit_m) consider(EventKind::track_end);
    return first;
  }

  /// Time within (0, h] at which the indicator turns positive, given that it is positive at h.
  double root(EventKind kind, double h) const {
    const auto f = [&](double t) { return indicator(plain_, plain_step(t), kind); };
    double low = 0.0, high = h;
    double f_low = indicator(plain_, plain_state(state_), kind), f_high = f(h);
    if (!(f_low < 0.0)) {
      // Started on the event itself, at rest: look inside for a time at which the motion has left it.
      double inside = h;
      for (int i = 0; i < most_root_iterations && inside > root_tolerance_s; ++i) {
        inside *= 0.5;
        const double f_inside = f(inside);
        if (f_inside < 0.0) {
          low = inside;
          f_low = f_inside;
          break;
        }
        high = inside;
        f_high = f_inside;
      }
      if (!(f_low < 0.0)) return 0.0;
    }
    for (int i = 0; i < most_root_iterations && high - low > root_tolerance_s; ++i) {
      double t = high - f_high * (high - low) / (f_high - f_low);
      if (!(t > low && t < high) || i % 4 == 3) t = 0.5 * (low + high);
      const double f_t = f(t);
      if (f_t == 0.0) return t;
      if (f_t > 0.0) {
        high = t;
        f_high = f_t;
        f_low *= 0.5;
      } else {
        low = t;
        f_low = f_t;
        f_high *= 0.5;
      }
    }
    return high;
  }

  /// Moves to an event and through it. Returns the time it took, with its derivative.
  S pass(const Found& found) {
    S taken(found.after_s);
    PlantState<S> at = rk4(dynamics_, state_, contacts_, drive_, taken);
    if constexpr (!std::is_same_v<S, double>) {
      // The root moves with the parameters: dt = -dg / (dg/dt).
      const S g = indicator(dynamics_, at, found.kind);
      const double slope = indicator_slope(found);
      constexpr double flattest = 1e-9;  // a grazing event has no derivative; keep it finite
      const S shift = (S(value_of(g)) - g) / S(std::max(slope, flattest));
      at = shifted(at, dynamics_.derivative(at, at.motor_v, contacts_), shift);
      if (dynamics_.has_motor_lag())
        at.motor_v = at.motor_v + shift * (drive_ - at.motor_v) / dynamics_.motor_time_constant_s();
      taken = taken + shift;
    }
    state_ = at;
    time_s_ += found.after_s;
    events_[event_count_++ % kept_events] = {time_s_, found.kind};
    switch (found.kind) {
      case EventKind::cart_reversal:
      case EventKind::cart_stick:
        state_.cart_mps = S(0.0);
        break;
      case EventKind::pivot_reversal:
      case EventKind::pivot_stick:
        state_.theta_radps = S(0.0);
        break;
      case EventKind::cart_breakaway:
        contacts_.cart =
            plain_.cart_load(plain_state(state_), value_of(state_.motor_v), contacts_.pivot) > 0.0
                ? Contact::slip_forward
                : Contact::slip_backward;
        break;
      case EventKind::pivot_breakaway:
        contacts_.pivot =
            plain_.pivot_load(plain_state(state_), value_of(state_.motor_v), contacts_.cart) > 0.0
                ? Contact::slip_forward
                : Contact::slip_backward;
        break;
      case EventKind::fall:
      case EventKind::track_end:
        halted_ = found.kind;
        break;
    }
    if (found.kind == EventKind::cart_stick || found.kind == EventKind::pivot_stick) {
      settle();
      if (found.kind == EventKind::cart_stick && contacts_.cart != Contact::stick)
        events_[(event_count_ - 1) % kept_events].kind = EventKind::cart_reversal;
      if (found.kind == EventKind::pivot_stick && contacts_.pivot != Contact::stick)
        events_[(event_count_ - 1) % kept_events].kind = EventKind::pivot_reversal;
    }
    return taken;
  }

  /// How fast the indicator rises where it crosses zero [1/s].
  double indicator_slope(const Found& found) const {
    constexpr double aside_s = 1e-7;
    const double before = indicator(plain_, plain_step(found.after_s), found.kind);
    const double after = indicator(plain_, plain_step(found.after_s + aside_s), found.kind);
    return (after - before) / aside_s;
  }

  /// Chooses the modes of contacts that are at rest so that they hold together: a sticking contact carries
  /// its load, a sliding one is driven the way it slides. Sticking is tried first.
  void settle() {
    const PlantState<double> s = plain_state(state_);
    const bool cart_rests = dynamics_.cart_can_stick() && !dynamics_.cart_locked() && s.cart_mps == 0.0;
    const bool pivot_rests = dynamics_.pivot_can_stick() && s.theta_radps == 0.0;
    if (!cart_rests && !pivot_rests) return;
    constexpr std::array modes = {Contact::stick, Contact::slip_forward, Contact::slip_backward};
    for (const Contact cart : modes) {
      if (!cart_rests && cart != contacts_.cart) continue;
      for (const Contact pivot : modes) {
        if (!pivot_rests && pivot != contacts_.pivot) continue;
        const bool cart_holds = !cart_rests || holds(cart, plain_.cart_load(s, s.motor_v, pivot),
                                                     plain_.cart_dry_level(s.cart_m, 0.0, 1.0),
                                                     plain_.cart_dry_level(s.cart_m, 0.0, -1.0));
        const bool pivot_holds = !pivot_rests || holds(pivot, plain_.pivot_load(s, s.motor_v, cart),
                                                       plain_.pivot_dry_level(), plain_.pivot_dry_level());
        if (cart_holds && pivot_holds) {
          contacts_ = {cart, pivot};
          return;
        }
      }
    }
    if (cart_rests) contacts_.cart = Contact::stick;
    if (pivot_rests) contacts_.pivot = Contact::stick;
  }

  static bool holds(Contact mode, double load, double forward_level, double backward_level) {
    switch (mode) {
      case Contact::slip_forward:
        return load > forward_level;
      case Contact::slip_backward:
        return -load > backward_level;
      case Contact::stick:
        break;
    }
    return load <= forward_level && -load <= backward_level;
  }

  Dynamics<S> dynamics_;
  Dynamics<double> plain_;
  EngineOptions options_;
  PlantState<S> state_{};
  Contacts contacts_;
  S drive_{};
  double time_s_ = 0.0;
  std::optional<EventKind> halted_;
  std::uint64_t event_count_ = 0;
  std::array<Event, kept_events> events_{};
};

}  // namespace upright
