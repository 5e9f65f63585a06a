// Contacts and events, shared by all engines: the events to watch for in a state,
// functions whose roots are the events, and consistent contact modes after an event. Pure
// functions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "upright/model/dynamics.hpp"

namespace upright {

/// What can happen to the contacts of a plant during a step, and what ends its motion.
enum class EventKind : std::uint8_t {
  cart_stick,
  cart_breakaway,
  cart_reversal,
  pivot_stick,
  pivot_breakaway,
  pivot_reversal,
  fall,
  track_end,
  /// The voltage passes a corner of the actuator chain. Engines restart there; it counts as no event.
  actuator_corner,
};

/// What happened during the integration.
struct Event {
  double time_s = 0.0;                     ///< when it happened [s]
  EventKind kind = EventKind::cart_stick;  ///< what happened
};

/// How an engine integrates.
struct EngineOptions {
  double max_step_s = 1e-3;  ///< longest step [s]
  /// Upper bound of the step of the Runge-Kutta engine, as a fraction of the inverse of the greatest rate
  /// of the motion.
  double step_fraction = 0.2;
  /// Lower bound of the step of the Runge-Kutta engine except at events: a bound on the work of an engine
  /// for which a control loop waits.
  double min_step_s = 0.0;
  /// Whether Runge-Kutta steps resolve the cart's oscillation on its bristles where their relaxation
  /// damps it. False: stiff bristles cost nothing, with position errors of about 1e-6 m.
  bool resolve_bristles = true;
  /// Whether Runge-Kutta steps stay below the motor's time constant. False: a short lag costs nothing. The
  /// impulse of its voltage, and the moments of that, are exact in either case.
  bool resolve_lag = true;
  /// Relative tolerance of the reference engine.
  double relative_tolerance = 1e-10;
  /// Tolerance of event times of the Runge-Kutta engine.
  double event_tolerance_s = 1e-14;
  std::optional<double> fall_angle_rad;  ///< the simulation halts where |theta| reaches it
  std::optional<double> track_limit_m;   ///< the simulation halts where |x| reaches it
  /// Derivatives of the Runge-Kutta engine with dual numbers, for plants without bristles: those
  /// of the motion linearised at the middle of the step, at a third of the cost. Their relative error is
  /// about 1e-4 (1e-3 beside a motor lag) in steps of 4 ms, second order in the step; the motion itself is
  /// unchanged.
  bool quick_derivatives = false;
};

/// An event to watch for. `sign`: direction of the motion before it; `corner_v`: voltage of a corner.
struct Watch {
  EventKind kind = EventKind::cart_stick;  ///< what happens there
  double sign = 1.0;                       ///< direction of the motion before it
  double corner_v = 0.0;                   ///< voltage of a corner of the actuator chain [V]
};

/// A list of a few watches, without allocation.
struct WatchList {
  std::array<Watch, 6> items{};                              ///< the first `count` are in use
  std::size_t count = 0;                                     ///< how many are in use
  void add(const Watch& watch) { items[count++] = watch; }   ///< appends one
  const Watch* begin() const { return items.data(); }        ///< the first one
  const Watch* end() const { return items.data() + count; }  ///< beyond the last one
};

/// The contact of a motion with this velocity.
inline Contact direction_of(double velocity) {
  if (velocity == 0.0) return Contact::stick;
  return velocity > 0.0 ? Contact::slip_forward : Contact::slip_backward;
}

/// -1, 0 or 1.
inline double sign_of_contact(Contact contact) {
  return static_cast<double>(contact);
}

/// The contact modes that follow from the velocities, before `settled_contacts` decides on those at rest.
inline Contacts contacts_of(const PlantState<double>& s) {
  return {direction_of(s.cart_mps), direction_of(s.theta_radps)};
}

namespace detail {

inline bool holds(Contact mode, double load, double forward_level, double backward_level) {
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

}  // namespace detail

/// Chooses consistent modes for contacts at rest: a sticking contact carries its load, a
/// sliding one accelerates in its direction. Sticking is tried first. Moving contacts are
/// unchanged.
template <class Present>
Contacts settled_contacts(const Dynamics<double, Present>& dynamics, const PlantState<double>& s,
                          Contacts contacts) {
  const bool cart_rests = dynamics.cart_can_stick() && !dynamics.cart_locked() && s.cart_mps == 0.0;
  const bool pivot_rests = dynamics.pivot_can_stick() && s.theta_radps == 0.0;
  if (!cart_rests && !pivot_rests) return contacts;
  constexpr std::array modes = {Contact::stick, Contact::slip_forward, Contact::slip_backward};
  for (const Contact cart : modes) {
    if (!cart_rests && cart != contacts.cart) continue;
    for (const Contact pivot : modes) {
      if (!pivot_rests && pivot != contacts.pivot) continue;
      const bool cart_holds = !cart_rests || detail::holds(cart, dynamics.cart_load(s, s.motor_v, pivot),
                                                           dynamics.cart_dry_level(s, s.motor_v, 0.0, 1.0),
                                                           dynamics.cart_dry_level(s, s.motor_v, 0.0, -1.0));
      const bool pivot_holds =
          !pivot_rests || detail::holds(pivot, dynamics.pivot_load(s, s.motor_v, cart),
                                        dynamics.pivot_dry_level(), dynamics.pivot_dry_level());
      if (cart_holds && pivot_holds) return {cart, pivot};
    }
  }
  if (cart_rests) contacts.cart = Contact::stick;
  if (pivot_rests) contacts.pivot = Contact::stick;
  return contacts;
}

/// The events that are possible next. `held`: contacts at rest stay at rest, and their breakaway is not
/// watched (which ends an unbounded sequence of events at one time).
template <class S, class Present>
WatchList next_events(const Dynamics<S, Present>& dynamics, double cart_mps, double theta_radps,
                      Contacts contacts, const EngineOptions& options, bool held = false) {
  WatchList list;
  if (!dynamics.cart_locked() && dynamics.cart_has_kink()) {
    if (!dynamics.cart_can_stick()) {
      if (cart_mps != 0.0 && !held) list.add({EventKind::cart_reversal, cart_mps > 0.0 ? 1.0 : -1.0});
    } else if (contacts.cart != Contact::stick) {
      list.add({EventKind::cart_stick, sign_of_contact(contacts.cart)});
    } else if (!held) {
      list.add({EventKind::cart_breakaway});
    }
  }
  if (dynamics.pivot_has_kink()) {
    if (!dynamics.pivot_can_stick()) {
      if (theta_radps != 0.0 && !held) list.add({EventKind::pivot_reversal, theta_radps > 0.0 ? 1.0 : -1.0});
    } else if (contacts.pivot != Contact::stick) {
      list.add({EventKind::pivot_stick, sign_of_contact(contacts.pivot)});
    } else if (!held) {
      list.add({EventKind::pivot_breakaway});
    }
  }
  if (options.fall_angle_rad && dynamics.has_pendulum()) list.add({EventKind::fall});
  if (options.track_limit_m) list.add({EventKind::track_end});
  return list;
}

/// An event indicator: not positive before the event, positive after it. Engines treat the corners of the
/// actuator chain themselves.
template <class S, class Present>
S event_indicator(const Dynamics<S, Present>& dynamics, const PlantState<S>& s, Contacts contacts,
                  const Watch& watch, const EngineOptions& options) {
  switch (watch.kind) {
    case EventKind::cart_stick:
    case EventKind::cart_reversal:
      return watch.sign > 0.0 ? S(-s.cart_mps) : s.cart_mps;
    case EventKind::pivot_stick:
    case EventKind::pivot_reversal:
      return watch.sign > 0.0 ? S(-s.theta_radps) : s.theta_radps;
    case EventKind::cart_breakaway: {
      const S load = dynamics.cart_load(s, s.motor_v, contacts.pivot);
      const S forward = load - dynamics.cart_dry_level(s, s.motor_v, S(0.0), S(1.0));
      const S backward = -load - dynamics.cart_dry_level(s, s.motor_v, S(0.0), S(-1.0));
      return forward > backward ? forward : backward;
    }
    case EventKind::pivot_breakaway:
      return absolute(dynamics.pivot_load(s, s.motor_v, contacts.cart)) - dynamics.pivot_dry_level();
    case EventKind::fall:
      return absolute(s.theta_rad) - S(*options.fall_angle_rad);
    case EventKind::track_end:
      return absolute(s.cart_m) - S(*options.track_limit_m);
    case EventKind::actuator_corner:
      break;
  }
  return S(-1.0);
}

/// The modes after an event, in the state of the event, with the velocity of a contact that came to rest
/// set to zero. `held`: as in `next_events`.
template <class Present>
Contacts contacts_after(const Dynamics<double, Present>& dynamics, const PlantState<double>& s,
                        Contacts contacts, EventKind kind, bool held = false) {
  switch (kind) {
    case EventKind::cart_breakaway:
      contacts.cart = dynamics.cart_load(s, s.motor_v, contacts.pivot) > 0.0 ? Contact::slip_forward
                                                                             : Contact::slip_backward;
      return contacts;
    case EventKind::pivot_breakaway:
      contacts.pivot = dynamics.pivot_load(s, s.motor_v, contacts.cart) > 0.0 ? Contact::slip_forward
                                                                              : Contact::slip_backward;
      return contacts;
    case EventKind::cart_stick:
      contacts.cart = Contact::stick;
      return held ? contacts : settled_contacts(dynamics, s, contacts);
    case EventKind::pivot_stick:
      contacts.pivot = Contact::stick;
      return held ? contacts : settled_contacts(dynamics, s, contacts);
    default:
      return contacts;
  }
}

/// The kind of a stick event, resolved once it is known whether the contact stays at rest.
inline EventKind resolved_kind(EventKind kind, Contacts after) {
  if (kind == EventKind::cart_stick && after.cart != Contact::stick) return EventKind::cart_reversal;
  if (kind == EventKind::pivot_stick && after.pivot != Contact::stick) return EventKind::pivot_reversal;
  return kind;
}

/// Whether a simulation has ended in this state: fallen, or beyond the track.
inline std::optional<EventKind> ended_at(double theta_rad, double cart_m, bool has_pendulum,
                                         const EngineOptions& options) {
  if (has_pendulum && options.fall_angle_rad && std::abs(theta_rad) > *options.fall_angle_rad)
    return EventKind::fall;
  if (options.track_limit_m && std::abs(cart_m) > *options.track_limit_m) return EventKind::track_end;
  return std::nullopt;
}

/// Counts events in windows of time. In a window with too many events, engines keep contacts at rest, so
/// that chattering does not cause unbounded work.
class EventBudget {
 public:
  /// Begins a window at `time_s`.
  void restart(double time_s) {
    window_begin_s_ = time_s;
    events_ = 0;
  }
  /// Called before each step.
  bool spent(double time_s) {
    if (time_s - window_begin_s_ >= window_s) restart(time_s);
    return events_ >= max_events;
  }
  void count() { ++events_; }  ///< counts one event

 private:
  static constexpr double window_s = 1e-4;
  static constexpr int max_events = 24;
  double window_begin_s_ = 0.0;
  int events_ = 0;
};

/// The corners of a plant's actuator chain in increasing order of the command [V]: limits of the dead
/// zone and of saturation.
template <class S>
struct ActuatorCorners {
  std::array<double, 4> volts{};  ///< the first `count` are in use [V]
  std::size_t count = 0;          ///< how many corners there are

  /// Those of this model's actuator chain.
  explicit ActuatorCorners(const PlantModel<S>& model) {
    constexpr std::size_t dead = effect_index<effects::VoltageDeadZone>();
    constexpr std::size_t gain = effect_index<effects::VoltageGain>();
    constexpr std::size_t offset = effect_index<effects::VoltageOffset>();
    constexpr std::size_t saturation = effect_index<effects::VoltageSaturation>();
    const double half = model.present.template has<dead>() ? value_of(model.template of<dead>()[0]) : 0.0;
    const double scale = model.present.template has<gain>() ? value_of(model.template of<gain>()[0]) : 1.0;
    const double shift =
        model.present.template has<offset>() ? value_of(model.template of<offset>()[0]) : 0.0;
    if (half > 0.0) {
      volts[count++] = -half;
      volts[count++] = half;
    }
    if (model.present.template has<saturation>()) {
      const double limit = value_of(model.template of<saturation>()[0]);
      for (const double end : {-limit, limit}) {
        const double before = (end - shift) / scale;
        volts[count++] = before + (before > 0.0 ? half : before < 0.0 ? -half : 0.0);
      }
    }
    std::sort(volts.begin(), volts.begin() + static_cast<std::ptrdiff_t>(count));
  }

  /// Adds the nearest corners below and above a voltage.
  void watch(double at_v, WatchList& list) const {
    const double here = 1e-12 * (1.0 + std::abs(at_v));  // a corner at this voltage was just passed
    double below = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < count; ++i) {
      if (volts[i] < at_v - here) below = volts[i];
      if (volts[i] > at_v + here) {
        list.add({EventKind::actuator_corner, 1.0, volts[i]});
        break;
      }
    }
    if (std::isfinite(below)) list.add({EventKind::actuator_corner, -1.0, below});
  }
};

/// The motion over one step as a polynomial in time about `at_s`; `factor[k]` multiplies (t - at_s)^k.
/// Passed to step sinks under a varying voltage; dense output for delayed feedback.
struct DenseStep {
  static constexpr int max_factors = 13;                 ///< of the longest polynomial
  double begin_s = 0.0;                                  ///< where the step begins [s]
  double end_s = 0.0;                                    ///< where the step ends [s]
  double at_s = 0.0;                                     ///< the time about which it is expanded [s]
  int factors = 0;                                       ///< how many factors are in use
  bool ends_at_event = false;                            ///< the acceleration is discontinuous at `end_s`
  bool ends_at_corner = false;                           ///< the derivative of the acceleration is
  std::array<PlantState<double>, max_factors> factor{};  ///< of each power of time
};

/// Sets the flags of a step that ends at `found`; null: it ends at nothing.
inline void mark_end(DenseStep& step, const Watch* found) {
  step.ends_at_corner = found != nullptr && found->kind == EventKind::actuator_corner;
  step.ends_at_event = found != nullptr && !step.ends_at_corner;
}

}  // namespace upright
