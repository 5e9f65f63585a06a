#include "extended_kalman_filter.hpp"

#include <cmath>

namespace upright {

namespace {

/// The engine gets the voltage behind the static chain and the delay, which the filter follows itself. What
/// has a state stays.
Plant without_static_actuator(Plant plant) {
  const std::size_t lag = effect_number("motor_lag");
  for (std::size_t effect = 0; effect < effect_count; ++effect)
    if (effect_registry()[effect].enters == Enters::actuator && effect != lag && !attaches_mass(effect))
      plant.remove(effect);
  return plant;
}

/// The estimate is good to a rounded count, so that steps need not be finer than the motion.
EngineOptions options_for(double period_s) {
  constexpr double max_steps = 4.0;
  EngineOptions options;
  options.max_step_s = period_s;
  options.min_step_s = period_s / max_steps;
  options.step_fraction = 1.0;
  options.resolve_bristles = false;
  options.event_tolerance_s = 1e-4 * period_s;
  return options;
}

}  // namespace

ExtendedKalmanFilter::ExtendedKalmanFilter(const ControlConfig& config, const Plant& plant)
    : KalmanFilter(config, plant),
      engine_(make_model<double>(without_static_actuator(plant)), options_for(config.period_s())),
      period_s_(config.period_s()),
      early_s_(input_fraction() * config.period_s()),
      volts_per_newton_(1.0 / plant.motor.force_per_volt_n),
      encoder_differs_(plant.find("drive_compliance") != nullptr ||
                       plant.find("encoder_eccentricity") != nullptr),
      friction_share_(config.friction.share),
      friction_follows_(config.period_s() / (config.period_s() + config.friction.lag_s)) {
  ExtendedKalmanFilter::start(0.0, 0.0);
}

void ExtendedKalmanFilter::start(double cart_m, double theta_rad) noexcept {
  KalmanFilter::start(cart_m, theta_rad);
  friction_lagged_n_ = 0.0;
  engine_.start({state_(filter_cart), state_(filter_theta)}, 0.0, resting_v());
}

/// The engine's state with the force on the cart as a part of the voltage at the motor, which it is
/// proportional to.
PlantState<double> ExtendedKalmanFilter::plant_state(double drive_v) const noexcept {
  PlantState<double> state = engine_.state();
  state.cart_m = state_(filter_cart);
  state.theta_rad = state_(filter_theta);
  state.cart_mps = state_(filter_cart_velocity);
  state.theta_radps = state_(filter_pendulum_rate);
  state.motor_v = (lags() ? state_(filter_motor) : drive_v) + volts_per_newton_ * state_(filter_cart_force);
  return state;
}

void ExtendedKalmanFilter::take(const PlantState<double>& state) noexcept {
  state_(filter_cart) = state.cart_m;
  state_(filter_theta) = state.theta_rad;
  state_(filter_cart_velocity) = state.cart_mps;
  state_(filter_pendulum_rate) = state.theta_radps;
  if (lags()) state_(filter_motor) = state.motor_v - volts_per_newton_ * state_(filter_cart_force);
}

void ExtendedKalmanFilter::propagate(double late_v, double early_v) noexcept {
  const double force_v = volts_per_newton_ * state_(filter_cart_force);
  engine_.correct(plant_state(early_s_ > 0.0 ? early_v : late_v));
  if (early_s_ > 0.0) engine_.advance(early_s_, early_v + force_v);
  engine_.advance(period_s_ - early_s_, late_v + force_v);
  const PlantState<double>& moved = engine_.state();
  if (!std::isfinite(moved.cart_mps) || !std::isfinite(moved.theta_radps) || !std::isfinite(moved.bristle_m))
    engine_.start({state_(filter_cart), state_(filter_theta)}, 0.0, late_v);
  take(engine_.state());
  friction_lagged_n_ += friction_follows_ * (friction_n() - friction_lagged_n_);
}

double ExtendedKalmanFilter::encoder_ahead_m() const noexcept {
  if (!encoder_differs_) return 0.0;
  PlantState<double> state = engine_.state();
  state.motor_v -= volts_per_newton_ * state_(filter_cart_force);
  return position_of(engine_.dynamics().measure(state).cart_m) - state.cart_m;
}

/// Of the model's contact or bristles, at the end of the period.
double ExtendedKalmanFilter::friction_n() const noexcept {
  const Dynamics<double>& dynamics = engine_.dynamics();
  const PlantState<double>& s = engine_.state();
  if (dynamics.has_bristle_state()) {
    const double rate = dynamics.derivative(s, s.motor_v, engine_.contacts()).bristle_m;
    return -dynamics.bristle_stiffness() * s.bristle_m - dynamics.bristle_damping() * rate;
  }
  if (!dynamics.cart_can_stick()) return 0.0;
  if (engine_.cart_at_rest()) return -dynamics.cart_load(s, s.motor_v, engine_.contacts().pivot);
  const double direction = sign_of_contact(engine_.contacts().cart);
  return -direction * dynamics.cart_dry_level(s, s.motor_v, std::abs(s.cart_mps), direction);
}

double ExtendedKalmanFilter::rejected_force_n() const noexcept {
  return KalmanFilter::rejected_force_n() + friction_share_ * friction_lagged_n_;
}

}  // namespace upright
