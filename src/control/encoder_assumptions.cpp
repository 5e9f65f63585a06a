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

/// Smallest voltage in a direction that overcomes what holds the cart at rest there; the limit where none
/// does.
double breakaway_v(const Dynamics<double>& dynamics, double cart_m, double direction, double limit_v) {
  PlantState<double> state{};
  state.cart_m = cart_m;
  const auto moves = [&](double volts) {
    const double motor_v = dynamics.actuate(direction * volts);
    return direction * dynamics.cart_smooth_force(state, motor_v) >
           dynamics.cart_dry_level(cart_m, 0.0, direction);
  };
  if (moves(0.0)) return 0.0;
  double low = 0.0, high = limit_v;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (moves(middle) ? high : low) = middle;
  }
  return high;
}

Bounds breakaway_over_track(const Dynamics<double>& dynamics, double track_limit_m, double limit_v) {
  constexpr int places = 400;  // cogging repeats every few millimetres
  Bounds bounds{limit_v, 0.0};
  for (int i = 0; i <= places; ++i)
    for (const double direction : {-1.0, 1.0}) {
      const double volts =
          breakaway_v(dynamics, track_limit_m * (2.0 * i / places - 1.0), direction, limit_v);
      bounds.low = std::min(bounds.low, volts);
      bounds.high = std::max(bounds.high, volts);
    }
  return bounds;
}

}  // namespace

EncoderAssumptions encoder_assumptions(const Plant& plant, double track_limit_m, double amplifier_limit_v,
                                       double uncertainty) {
  const double more = 1.0 + uncertainty, less = 1.0 / more;
  const Dynamics<double> dynamics(make_model<double>(plant));
  const BaseParameters<double> base = make_model<double>(plant).corrected();
  EncoderAssumptions a;
  const Bounds breakaway = breakaway_over_track(dynamics, track_limit_m, amplifier_limit_v);
  a.breakaway_v = {breakaway.low * less, breakaway.high * more};
  const double lag_s = dynamics.input_delay_s() + dynamics.motor_time_constant_s();
  a.largest_lag_s = lag_s * more + unnamed_lag_s;

  const PlantState<double> rest{};
  const auto force = [&](double volts) { return dynamics.cart_smooth_force(rest, dynamics.actuate(volts)); };
  const double force_per_volt_n =
      (force(amplifier_limit_v) - force(-amplifier_limit_v)) / (2.0 * amplifier_limit_v);
  double mass_kg = base.cart_mass_kg;
  if (plant.pendulum) {
    const double moment_kgm = base.pendulum_mass_kg * base.length_to_com_m;
    mass_kg += base.pendulum_mass_kg;
    a.longest_pendulum_m = more * base.inertia_about_pivot_kgm2 / moment_kgm;
    a.pivot_friction_mps2 = std::max(a.pivot_friction_mps2, more * dynamics.pivot_dry_level() / moment_kgm);
  }
  a.acceleration_mps2_per_v = less * force_per_volt_n / mass_kg;
  constexpr double usual_mps = 0.5;
  PlantState<double> moving{};
  moving.cart_mps = usual_mps;
  const double drag_n = dynamics.cart_smooth_force(rest, 0.0) - dynamics.cart_smooth_force(moving, 0.0);
  a.damping_v_per_mps = std::max(0.0, more * drag_n / (usual_mps * force_per_volt_n));
  return a;
}

EncoderAssumptions either(const EncoderAssumptions& a, const EncoderAssumptions& b) {
  const auto around = [](const Bounds& p, const Bounds& q) {
    return Bounds{std::min(p.low, q.low), std::max(p.high, q.high)};
  };
  return {around(a.breakaway_v, b.breakaway_v),
          std::max(a.largest_lag_s, b.largest_lag_s),
          std::min(a.acceleration_mps2_per_v, b.acceleration_mps2_per_v),
          std::max(a.damping_v_per_mps, b.damping_v_per_mps),
          std::max(a.unseen_travel_m, b.unseen_travel_m),
          std::max(a.longest_pendulum_m, b.longest_pendulum_m),
          std::max(a.pivot_friction_mps2, b.pivot_friction_mps2)};
}

void encoder_assumption_keys(YamlKeys& keys, EncoderAssumptions& a) {
  keys.usual_map("breakaway_v", [&](YamlKeys& breakaway) {
    breakaway.number("from", a.breakaway_v.low, Range::within(0.0, 100.0));
    breakaway.number("to", a.breakaway_v.high, Range::within(a.breakaway_v.low, 100.0));
  });
  keys.number("largest_lag_s", a.largest_lag_s, Range::within(0.0, 1.0), a.largest_lag_s);
  keys.number("acceleration_mps2_per_v", a.acceleration_mps2_per_v, Range{0.0, 1e4, true},
              a.acceleration_mps2_per_v);
  keys.number("damping_v_per_mps", a.damping_v_per_mps, Range::within(0.0, 1e4), a.damping_v_per_mps);
  keys.number("unseen_travel_m", a.unseen_travel_m, Range::within(0.0, 0.1), a.unseen_travel_m);
  keys.number("longest_pendulum_m", a.longest_pendulum_m, Range{0.0, 100.0, true}, a.longest_pendulum_m);
  keys.number("pivot_friction_mps2", a.pivot_friction_mps2, Range::within(0.0, 100.0), a.pivot_friction_mps2);
}

std::string encoder_assumptions_text(EncoderAssumptions assumptions) {
  YamlKeyWriter writer(YamlKeyWriter::Layout::one_line);
  encoder_assumption_keys(writer, assumptions);
  return "{" + writer.written() + "}";
}

}  // namespace upright
