#include "script_context.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/angle_units.hpp"

namespace upright {

namespace {

constexpr double servo_bandwidth_radps = 15.0;
constexpr double push_gain = 20.0;  // V/s per m/s that is missing
constexpr double max_push_v = 3.0;
constexpr double start_margin_m = 0.015;
// A cart that sticks cannot take out the last few degrees of a swing.
constexpr double rest_lean_rad = 0.045;

// The guard that keeps the cart on its travel brakes with this much.
constexpr double braking_v = 6.0;
constexpr double braking_share = 0.6;
constexpr double reaction_s = 0.01;

}  // namespace

double ScriptContext::side_m() const noexcept {
  return travel_m - start_margin_m;
}

double wrapped(double angle_rad) noexcept {
  return angle_rad - full_turn_rad * std::round(angle_rad / full_turn_rad);
}

double hanging_lean(const ScriptContext& context, const ControlState& now) noexcept {
  return context.servo.pendulum_m > 0.0 ? wrapped(now.theta_rad - std::numbers::pi) : 0.0;
}

bool hangs_still(const ScriptContext& context, const ControlState& now) noexcept {
  return std::abs(hanging_lean(context, now)) < rest_lean_rad &&
         std::abs(now.pendulum_rate_radps) < rest_radps;
}

double stop_position_m(const ScriptContext& context, const ControlState& now) noexcept {
  const ServoModel& m = context.servo;
  const double v = now.cart_velocity_mps;
  const double braking =
      (braking_share * m.force_per_volt_n * std::min(context.voltage_limit_v, braking_v) + m.sliding_n) /
      m.mass_kg;
  return now.cart_m + v * (reaction_s + 2.0 * context.period_s) + v * std::abs(v) / (2.0 * braking);
}

/// Feed-forward of damping and friction, proportional on the error, and a growing push where it sticks.
double CartServo::voltage_v(double speed_mps, const ControlState& now, double elapsed_s) noexcept {
  const ServoModel& m = model_;
  const double v = now.cart_velocity_mps;
  double friction = 0.0;
  if (std::abs(v) > standing_mps) {
    friction = m.sliding_n * sign(v);
    push_v_ *= std::max(0.0, 1.0 - 10.0 * elapsed_s);
  } else if (speed_mps != 0.0) {
    friction = 1.05 * m.breakaway_n * sign(speed_mps);
    push_v_ = std::clamp(push_v_ + push_gain * speed_mps * elapsed_s, -max_push_v, max_push_v);
  }
  const double gain = servo_bandwidth_radps * m.mass_kg / m.force_per_volt_n;
  return (m.damping_n_per_mps * speed_mps + friction) / m.force_per_volt_n + gain * (speed_mps - v) + push_v_;
}

}  // namespace upright
