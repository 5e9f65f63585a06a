#include "upright/control/encoder_assumptions.hpp"

#include <algorithm>
#include <cmath>

#include "base/yaml_keys.hpp"
#include "upright/model/dynamics.hpp"
#include "upright/model/plant_model.hpp"

namespace upright {

namespace {

/// A hold period, jitter and what a file leaves out: most plant files do not name the actuator's delay and
/// lag, and amplifiers, cards and links are up to so late.
constexpr double unnamed_lag_s = 0.010;
/// The largest delay and lag of an actuator of which nothing is known: a slow serial link and its amplifier.
constexpr double usual_lag_s = 0.030;
/// Few plant files name the friction of the pivot: a hundredth of gravity, that is 0.6 degrees off the
/// vertical, holds no pendulum on ball bearings.
constexpr double usual_pivot_friction_mps2 = 0.1;
/// Machines give way in proportion to their size: 50 um on a track of twice 0.4 m.
constexpr double track_limits_of_unseen_travel = 8000.0;

/// An IP02 with up to 2 N of dry friction and each of Quanser's pendulums: what a rig is taken for whose file
/// states nothing else and whose plant is not known.
EncoderAssumptions ip02_assumptions(double track_limit_m) {
  EncoderAssumptions a;
  a.breakaway_v = {0.1, 1.4};
  a.largest_lag_s = usual_lag_s;
  a.acceleration_mps2_per_v = 1.1;
  a.damping_v_per_mps = 8.0;
  a.unseen_travel_m = track_limit_m / track_limits_of_unseen_travel;
  a.longest_pendulum_m = 0.7;
  a.pivot_friction_mps2 = usual_pivot_friction_mps2;
  return a;
}

/// Smallest voltage in a direction that overcomes what holds the cart at rest there; the limit where none
/// does.
double breakaway_v(const Dynamics<double>& dynamics, double cart_m, double direction, double limit_v) {
  PlantState<double> state{};
  state.cart_m = cart_m;
  const auto moves = [&](double volts) {
    const double motor_v = dynamics.actuate(direction * volts);
    return direction * dynamics.cart_smooth_force(state, motor_v) >
           dynamics.cart_dry_level(state, motor_v, 0.0, direction);
  };
  if (moves(0.0)) return 0.0;
  double low = 0.0, high = limit_v;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (moves(middle) ? high : low) = middle;
  }
  return high;
}

constexpr int places = 400;  // cogging repeats every few millimetres

double place_m(int number, double track_limit_m) {
  return track_limit_m * (2.0 * number / places - 1.0);
}

/// Widens the bounds to what the plant needs anywhere on the track.
void include_breakaway(const Dynamics<double>& dynamics, double track_limit_m, double limit_v,
                       Bounds& bounds) {
  for (int i = 0; i <= places; ++i)
    for (const double direction : {-1.0, 1.0}) {
      const double volts = breakaway_v(dynamics, place_m(i, track_limit_m), direction, limit_v);
      bounds.low = std::min(bounds.low, volts);
      bounds.high = std::max(bounds.high, volts);
    }
}

/// The force on a resting cart per volt [N/V].
double force_per_volt_n(const Dynamics<double>& dynamics, const PlantState<double>& rest, double limit_v) {
  const auto force = [&](double volts) {
    const double motor_v = dynamics.actuate(volts);
    return dynamics.cart_smooth_force(rest, motor_v) -
           std::copysign(dynamics.cart_dry_level_of_load(rest, motor_v), volts);
  };
  return (force(limit_v) - force(-limit_v)) / (2.0 * limit_v);
}

/// Where on the track the motor is weakest [m]; 0 if it is equally strong everywhere.
double weakest_place_m(const Dynamics<double>& dynamics, double track_limit_m, double limit_v) {
  constexpr double rounding = 1e-9;
  PlantState<double> rest{};
  double weakest_m = 0.0, least_n = force_per_volt_n(dynamics, rest, limit_v) * (1.0 - rounding);
  for (int i = 0; i <= places; ++i) {
    rest.cart_m = place_m(i, track_limit_m);
    const double here_n = force_per_volt_n(dynamics, rest, limit_v);
    if (!(here_n < least_n)) continue;
    least_n = here_n;
    weakest_m = rest.cart_m;
  }
  return weakest_m;
}

}  // namespace

EncoderAssumptions encoder_assumptions(const Plant& plant, double track_limit_m, double amplifier_limit_v,
                                       double uncertainty) {
  const double more = 1.0 + uncertainty, less = 1.0 / more;
  Dynamics<double> dynamics(make_model<double>(plant));
  const BaseParameters<double> base = make_model<double>(plant).corrected();
  EncoderAssumptions a;
  a.unseen_travel_m = track_limit_m / track_limits_of_unseen_travel;
  Bounds breakaway{amplifier_limit_v, 0.0};
  include_breakaway(dynamics, track_limit_m, amplifier_limit_v, breakaway);
  if (dynamics.changes_with_time()) {
    dynamics.set_time(0.0);  // the cold rig
    include_breakaway(dynamics, track_limit_m, amplifier_limit_v, breakaway);
  }
  a.breakaway_v = {breakaway.low * less, breakaway.high * more};
  const double lag_s = dynamics.input_delay_s() + dynamics.motor_time_constant_s();
  a.largest_lag_s = lag_s * more + unnamed_lag_s;

  PlantState<double> rest{};
  rest.cart_m = weakest_place_m(dynamics, track_limit_m, amplifier_limit_v);
  const double volt_n = force_per_volt_n(dynamics, rest, amplifier_limit_v);
  double mass_kg = base.cart_mass_kg;
  if (plant.pendulum) {
    const double moment_kgm = base.pendulum_mass_kg * base.length_to_com_m;
    mass_kg += base.pendulum_mass_kg;
    a.longest_pendulum_m = more * base.inertia_about_pivot_kgm2 / moment_kgm;
    a.pivot_friction_mps2 =
        std::max(usual_pivot_friction_mps2, more * dynamics.pivot_dry_level() / moment_kgm);
  }
  a.acceleration_mps2_per_v = less * volt_n / mass_kg;
  constexpr double usual_mps = 0.5;
  PlantState<double> moving = rest;
  moving.cart_mps = usual_mps;
  const double drag_n = dynamics.cart_smooth_force(rest, 0.0) - dynamics.cart_smooth_force(moving, 0.0);
  a.damping_v_per_mps = std::max(0.0, more * drag_n / (usual_mps * volt_n));
  return a;
}

EncoderAssumptions encoder_assumptions(const StatedAssumptions& stated, double track_limit_m) {
  const EncoderAssumptions ip02 = ip02_assumptions(track_limit_m);
  return {stated.breakaway_v.value_or(ip02.breakaway_v),
          stated.largest_lag_s.value_or(ip02.largest_lag_s),
          stated.acceleration_mps2_per_v.value_or(ip02.acceleration_mps2_per_v),
          stated.damping_v_per_mps.value_or(ip02.damping_v_per_mps),
          stated.unseen_travel_m.value_or(ip02.unseen_travel_m),
          stated.longest_pendulum_m.value_or(ip02.longest_pendulum_m),
          stated.pivot_friction_mps2.value_or(ip02.pivot_friction_mps2)};
}

std::vector<std::string> missing_assumptions(const StatedAssumptions& stated) {
  std::vector<std::string> missing;
  if (!stated.breakaway_v) missing.emplace_back("breakaway_v");
  if (!stated.acceleration_mps2_per_v) missing.emplace_back("acceleration_mps2_per_v");
  if (!stated.damping_v_per_mps) missing.emplace_back("damping_v_per_mps");
  if (!stated.longest_pendulum_m) missing.emplace_back("longest_pendulum_m");
  return missing;
}

EncoderAssumptions widened(EncoderAssumptions a, const StatedAssumptions& stated) {
  const auto up_to = [](double& bound, const std::optional<double>& other) {
    bound = std::max(bound, other.value_or(bound));
  };
  const auto down_to = [](double& bound, const std::optional<double>& other) {
    bound = std::min(bound, other.value_or(bound));
  };
  if (stated.breakaway_v) {
    down_to(a.breakaway_v.low, stated.breakaway_v->low);
    up_to(a.breakaway_v.high, stated.breakaway_v->high);
  }
  up_to(a.largest_lag_s, stated.largest_lag_s);
  down_to(a.acceleration_mps2_per_v, stated.acceleration_mps2_per_v);
  up_to(a.damping_v_per_mps, stated.damping_v_per_mps);
  up_to(a.unseen_travel_m, stated.unseen_travel_m);
  up_to(a.longest_pendulum_m, stated.longest_pendulum_m);
  up_to(a.pivot_friction_mps2, stated.pivot_friction_mps2);
  return a;
}

void encoder_assumption_keys(YamlKeys& keys, StatedAssumptions& a) {
  keys.optional_map("breakaway_v", a.breakaway_v, [](YamlKeys& breakaway, Bounds& bounds) {
    breakaway.number("from", bounds.low, Range::within(0.0, 100.0));
    breakaway.number("to", bounds.high, Range::within(bounds.low, 100.0));
  });
  keys.optional_number("largest_lag_s", a.largest_lag_s, Range::within(0.0, 1.0));
  keys.optional_number("acceleration_mps2_per_v", a.acceleration_mps2_per_v, Range{0.0, 1e4, true});
  keys.optional_number("damping_v_per_mps", a.damping_v_per_mps, Range::within(0.0, 1e4));
  keys.optional_number("unseen_travel_m", a.unseen_travel_m, Range::within(0.0, 0.1));
  keys.optional_number("longest_pendulum_m", a.longest_pendulum_m, Range{0.0, 100.0, true});
  keys.optional_number("pivot_friction_mps2", a.pivot_friction_mps2, Range::within(0.0, 100.0));
}

std::string encoder_assumptions_text(const EncoderAssumptions& a) {
  StatedAssumptions all{a.breakaway_v,        a.largest_lag_s,   a.acceleration_mps2_per_v,
                        a.damping_v_per_mps,  a.unseen_travel_m, a.longest_pendulum_m,
                        a.pivot_friction_mps2};
  YamlKeyWriter writer(YamlKeyWriter::Layout::one_line);
  encoder_assumption_keys(writer, all);
  return "{" + writer.written() + "}";
}

}  // namespace upright
