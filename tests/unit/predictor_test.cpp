#include "control/predictor.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "model/linear_plant.hpp"
#include "upright/base/error.hpp"
#include "upright/control/controller.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {
namespace {

Plant viscous_plant() {
  return read_plant_file(std::filesystem::path(UPRIGHT_SOURCE_DIR) / "config/plants/viscous.yaml");
}

ControlConfig config_with(double delay_s, EstimatorKind kind = EstimatorKind::second_order_filter) {
  ControlConfig config;
  config.delay_s = delay_s;
  config.estimator.kind = kind;
  return config;
}

/// A pendulum so light in its motions that the plant is linear to 1e-9, pushed by random voltages: the
/// largest difference between the prediction and the state that the voltage then meets.
double worst_error(const Plant& plant, const ControlConfig& config, double scale = 1e-5) {
  const double period_s = config.period_s();
  const double input_delay_s = linearize(plant, 1.0).input_delay_s;
  Predictor predictor(config, plant);
  EstimatorStep step = make_estimator_step(config.estimator, period_s);
  VelocityEstimator cart(step), pendulum(step);
  DelayLine delay(config.delay_s, period_s);
  Simulator<double> simulator(make_model<double>(plant));
  PlantState<double> begin{};
  begin.theta_rad = scale;
  simulator.start(begin, 0.0, 0.0);
  const Outputs<double> first = simulator.engine().outputs();
  const ControlState held{first.cart_m, first.theta_rad, 0.0, 0.0};
  cart.start(held.cart_m);
  pendulum.start(held.theta_rad);
  delay.start(held);
  predictor.start(held);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> volts(-1e3 * scale, 1e3 * scale);
  std::deque<ControlState> predictions;
  double worst = 0.0, applied_v = 0.0;
  const auto ticks = static_cast<int>(0.8 / period_s);
  const auto settled = static_cast<int>((0.12 + config.delay_s) / period_s);
  for (int k = 0; k < ticks; ++k) {
    if (k > 0) {
      simulator.advance_to(k * period_s);
      const Outputs<double> y = simulator.engine().outputs();
      const ControlState now{y.cart_m, y.theta_rad, cart.step(y.cart_m), pendulum.step(y.theta_rad)};
      delay.push(now);
      predictions.push_back(predictor.compensate(delay.delayed(), applied_v));
    }
    applied_v = volts(random);
    simulator.command(k * period_s, applied_v);
    if (k == 0 || k < settled) {
      predictions.clear();
      continue;
    }
    if (predictions.empty()) continue;
    // What the prediction of now is about lies input_delay_s ahead: look there with a copy.
    Simulator<double> ahead = simulator;
    ahead.advance_to(k * period_s + input_delay_s);
    const Outputs<double> y = ahead.engine().outputs();
    const PlantState<double>& s = ahead.engine().state();
    const Outputs<double> zero = ahead.engine().dynamics().measure({});
    const double angle_scale = s.theta_rad == 0.0 ? 1.0 : (y.theta_rad - zero.theta_rad) / s.theta_rad;
    const ControlState& p = predictions.back();
    worst = std::max({worst, std::abs(p.cart_m - y.cart_m), std::abs(p.theta_rad - y.theta_rad),
                      std::abs(p.cart_velocity_mps - s.cart_mps),
                      std::abs(p.pendulum_rate_radps - angle_scale * s.theta_radps)});
  }
  return worst / scale;
}

TEST(Predictor, GivesTheStateThatTheVoltageMeets) {
  for (const double delay_s : {0.0, 0.001, 0.007, 0.1})
    for (const EstimatorKind kind : {EstimatorKind::second_order_filter, EstimatorKind::difference})
      EXPECT_LT(worst_error(viscous_plant(), config_with(delay_s, kind)), 1e-4) << delay_s;
}

TEST(Predictor, LooksThroughInputDelayMotorLagAndSensors) {
  Plant plant = viscous_plant();
  plant.set("input_delay", {0.013});
  EXPECT_LT(worst_error(plant, config_with(0.02)), 1e-4);
  plant.set("motor_lag", {0.008});
  EXPECT_LT(worst_error(plant, config_with(0.02)), 1e-4);
  plant.set("angle_scale", {1.1});
  plant.set("angle_offset", {0.02});
  EXPECT_LT(worst_error(plant, config_with(0.02)), 1e-4);
}

TEST(Predictor, KnowsTheActuatorExactly) {
  Plant plant = viscous_plant();
  plant.set("voltage_dead_zone", {2e-3});
  plant.set("voltage_gain", {0.8});
  plant.set("voltage_saturation", {5e-3});
  EXPECT_LT(worst_error(plant, config_with(0.03)), 1e-4);
}

TEST(Predictor, CountsAConstantForce) {
  Plant plant = viscous_plant();
  plant.set("constant_force", {1e-5});
  plant.set("voltage_offset", {2e-5});
  EXPECT_LT(worst_error(plant, config_with(0.03)), 1e-4);
}

TEST(Predictor, InterpolatesAFractionOfAPeriod) {
  // The delay line interpolates there: an error of the second order in the period.
  EXPECT_LT(worst_error(viscous_plant(), config_with(0.0074)), 3e-2);
  EXPECT_GT(worst_error(viscous_plant(), config_with(0.0074)), 0.0);
}

TEST(Predictor, DryLevelsDoNotChangeIt) {
  Plant rough = viscous_plant();
  rough.set("coulomb_friction", {0.43});
  rough.set("stribeck_friction", {0.43, 0.1, 2.0});
  const Predictor smooth_one(config_with(0.05), viscous_plant()), rough_one(config_with(0.05), rough);
  EXPECT_EQ(smooth_one.linear().measured, rough_one.linear().measured);
  EXPECT_EQ(smooth_one.linear().voltages, rough_one.linear().voltages);
}

TEST(Predictor, RefusesAPlantWithoutPendulumAndAnAbsurdHorizon) {
  Plant cart = viscous_plant();
  cart.pendulum.reset();
  EXPECT_THROW(Predictor(config_with(0.05), cart), ConfigError);
  Plant quick = viscous_plant();
  quick.pendulum->length_to_com_m = 1e-6;
  quick.pendulum->given_inertia_kgm2 = 1e-12;
  ControlConfig config = config_with(10.0);
  config.sample_rate_hz = 1000.0;
  EXPECT_THROW(Predictor(config, quick), ConfigError);
}

}  // namespace
}  // namespace upright
