#include "file_agreement.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

#include "runtime/overrun_limit.hpp"
#include "upright/base/error.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/runtime/session.hpp"

namespace upright {

namespace {

using Sentences = std::vector<std::string>;

std::string brief(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

/// What a rig of this kind has, from a finger's length to an industrial stage: wide enough for any that
/// somebody builds, and a mistaken unit (grams, millimetres, degrees) falls outside.
struct PlausibleRange {
  const char* key;
  double low, high;
  const char* unit;
};
constexpr PlausibleRange cart_mass{"cart_mass_kg", 0.02, 500.0, "kg"};
constexpr PlausibleRange pendulum_mass{"pendulum.mass_kg", 0.001, 200.0, "kg"};
constexpr PlausibleRange pendulum_length{"pendulum.length_to_com_m", 0.01, 5.0, "m"};
constexpr PlausibleRange gravity{"gravity_mps2", 9.7, 9.9, "m/s2"};  // on Earth 9.764 to 9.834
constexpr PlausibleRange track_limit{"track.limit_m", 0.02, 20.0, "m"};

void doubt(Sentences& doubts, const PlausibleRange& range, double value) {
  if (value >= range.low && value <= range.high) return;
  doubts.push_back(std::string(range.key) + " is " + brief(value) + " " + range.unit +
                   ", outside the usual range of " + brief(range.low) + " to " + brief(range.high) + " " +
                   range.unit + ": check the value and its unit");
}

/// A lost reply or two are ordinary: a watchdog that is shorter ends runs that nothing is wrong with.
constexpr double min_periods_of_a_watchdog = 3.0;

void compare_watchdogs(const RigFile& rig, const ControlConfig& control, Sentences& warnings) {
  const double period_s = control.period_s();
  const auto compare = [&](const char* key, double time_s, const char* consequence) {
    if (time_s >= min_periods_of_a_watchdog * period_s) return;
    warnings.push_back(std::string(key) + " is " + brief(time_s) + " s, but a period is " + brief(period_s) +
                       " s, so " + consequence + ": set it to at least " + brief(min_periods_of_a_watchdog) +
                       " periods, or raise sample_rate_hz");
  };
  compare("watchdog_s", rig.watchdog_s, "one lost reply ends the run");
  if (rig.modbus && !is_simulated(rig) && rig.modbus->watchdog)
    compare("modbus.device_watchdog.time_s", rig.modbus->watchdog->time_s,
            "the device may switch the voltage off between two requests");
}

/// An amplifier or a track that does not go with this plant.
void compare_rig_and_plant(const RigFile& rig, const Plant& plant, Sentences& warnings) {
  // Below, the amplifier cannot move the cart as a balancing cart moves; above, a unit is wrong.
  constexpr double slowest_mps2 = 0.2, fastest_mps2 = 2000.0;
  const double mass_kg = plant.cart_mass_kg + (plant.pendulum ? plant.pendulum->mass_kg : 0.0);
  const double max_mps2 = rig.amplifier.limit_v * std::abs(plant.motor.force_per_volt_n) / mass_kg;
  if (max_mps2 < slowest_mps2 || max_mps2 > fastest_mps2)
    warnings.push_back("at the amplifier's limit the cart accelerates at " + brief(max_mps2) +
                       " m/s2, which is implausible: check amplifier.limit_v, force_per_volt_n, the masses, "
                       "and their units");
  if (!plant.pendulum) return;
  // A cart that catches a fall of a few degrees moves by about a tenth of the pendulum's length.
  constexpr double min_share_of_length = 0.1;
  if (rig.track_limit_m < min_share_of_length * plant.pendulum->length_to_com_m)
    warnings.push_back("track.limit_m is " + brief(rig.track_limit_m) +
                       " m, which is short for a pendulum of " + brief(plant.pendulum->length_to_com_m) +
                       " m to its centre of mass: check both values and their units");
}

void judge_gains(const ControlConfig& control, const Plant& plant, Agreement& agreement) {
  if (!plant.pendulum) return;
  try {
    const OverrunLimit limit = overrun_limit(plant, control);
    require_stabilized(limit);
    if (!limit.warning.empty()) agreement.warnings.push_back(limit.warning);
  } catch (const ConfigError& error) {
    agreement.errors.emplace_back(error.what());
  }
}

}  // namespace

Sentences doubts_about(const Plant& plant) {
  Sentences doubts;
  doubt(doubts, cart_mass, plant.cart_mass_kg);
  doubt(doubts, gravity, plant.gravity_mps2);
  if (!plant.pendulum) return doubts;
  doubt(doubts, pendulum_mass, plant.pendulum->mass_kg);
  doubt(doubts, pendulum_length, plant.pendulum->length_to_com_m);
  return doubts;
}

Sentences doubts_about(const RigFile& rig) {
  Sentences doubts;
  doubt(doubts, track_limit, rig.track_limit_m);
  if (rig.fall_angle_rad > 0.5 * std::numbers::pi)
    doubts.push_back(
        "fall_angle_rad is " + brief(rig.fall_angle_rad) +
        " rad, which is beyond horizontal: set the angle at which the pendulum can no longer be caught");
  // A coarser encoder shows a balancing cart's motion in a few steps, and its velocity not at all.
  constexpr double min_counts_on_the_track = 100.0;
  if (rig.track_limit_m < min_counts_on_the_track * std::abs(rig.calibration.cart.per_count))
    doubts.push_back("calibration.cart.m_per_count is " + brief(rig.calibration.cart.per_count) +
                     " m, which gives fewer than " + brief(min_counts_on_the_track) +
                     " counts up to track.limit_m: check both values and their units");
  return doubts;
}

Sentences doubts_about(const ControlConfig& control) {
  Sentences doubts;
  const Gains& g = control.gains;
  const std::array<std::pair<const char*, double>, 4> gains = {
      std::pair{"cart_position_v_per_m", g.cart_position_v_per_m},
      {"pendulum_angle_v_per_rad", g.pendulum_angle_v_per_rad},
      {"cart_velocity_v_per_mps", g.cart_velocity_v_per_mps},
      {"pendulum_rate_v_per_radps", g.pendulum_rate_v_per_radps}};
  std::string negative;
  int zeros = 0;
  for (const auto& [name, value] : gains) {
    zeros += value == 0.0 ? 1 : 0;
    if (value < 0.0) negative += (negative.empty() ? "" : ", ") + std::string(name);
  }
  if (zeros == 4)
    doubts.emplace_back("all four gains are 0, so the controller does nothing: enter the designed gains");
  if (!negative.empty())
    doubts.push_back(
        negative +
        " below 0: with V = gains . state, voltage and theta_rad positive toward +x, gains that balance are "
        "positive; reverse the sign, or check the sign convention of the design");
  const double nyquist_hz = 0.5 * control.sample_rate_hz;
  if (control.estimator.kind == EstimatorKind::second_order_filter &&
      control.estimator.cutoff_hz > nyquist_hz)
    doubts.push_back("velocity_estimator.cutoff_hz is " + brief(control.estimator.cutoff_hz) +
                     " Hz, above half the sample rate (" + brief(nyquist_hz) +
                     " Hz), so the filter has no effect: lower it, or raise sample_rate_hz");
  return doubts;
}

Agreement agreement_of(const RunFiles& files) {
  Agreement agreement;
  if (files.rig && files.control) {
    try {
      require_link_fits(*files.rig, files.control->period_s());
      require_spin_fits(files.rig->spin_us, files.control->period_s());
      require_velocities(*files.control, files.rig->quanser && files.rig->quanser->reads_velocities);
    } catch (const ConfigError& error) {
      agreement.errors.emplace_back(error.what());
    }
    compare_watchdogs(*files.rig, *files.control, agreement.warnings);
  }
  if (files.rig && !files.plant && !is_simulated(*files.rig))
    if (const std::string gap = gap_of_encoder_watch(*files.rig); !gap.empty())
      agreement.warnings.push_back(gap);
  if (files.rig && files.plant) compare_rig_and_plant(*files.rig, *files.plant, agreement.warnings);
  if (files.control && files.plant) judge_gains(*files.control, *files.plant, agreement);
  return agreement;
}

}  // namespace upright
