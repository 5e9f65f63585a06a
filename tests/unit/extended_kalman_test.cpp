// The extended Kalman filter: what it knows that the stationary one does not, and what both must bear.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "design/estimator_design.hpp"
#include "upright/base/error.hpp"
#include "upright/control/controller.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {
namespace {

const std::string plants = UPRIGHT_SOURCE_DIR "/config/plants/";

Plant plant_named(const std::string& name) {
  return read_plant_file(plants + name + ".yaml");
}

/// Gains and defaults that suit every plant here; the force that is shown is the one beyond the model.
ControlConfig config_of(StateEstimatorKind kind) {
  ControlConfig config;
  config.gains = {49.3, 109.1, 39.3, 21.6};
  config.state_estimator.kind = kind;
  config.state_estimator.angle_zero_noise_rad2_per_s = 0.0;
  return config;
}

/// The estimator beside the plant in closed loop, from a lean.
class Beside {
 public:
  Beside(const Plant& plant, const ControlConfig& config, const Plant& model, double theta_rad = 0.03)
      : simulator_(make_model<double>(plant)),
        controller_(config, 15.0, make_model_parts(config, model, model)) {
    PlantState<double> state{};
    state.theta_rad = theta_rad;
    state.motor_v = simulator_.engine().dynamics().actuate(0.0);  // the amplifier has been on for a while
    simulator_.start(state);
  }

  /// Largest differences over the periods, from the truth at the moments of the readings.
  struct Off {
    double velocity_mps = 0.0, rate_radps = 0.0, force_n = 0.0;
  };
  Off go_on(int periods, int miss = 0) {
    Off off;
    for (int i = 0; i < periods; ++i, ++tick_) {
      const Outputs<double> y = simulator_.engine().outputs();
      const PlantState<double> truth = simulator_.engine().state();
      if (miss == 0 || tick_ % static_cast<std::uint64_t>(miss) != 1)
        output_ = controller_.step({tick_, y.cart_m, y.theta_rad, 0.0});
      off.velocity_mps =
          std::max(off.velocity_mps, std::abs(output_.state.cart_velocity_mps - truth.cart_mps));
      off.rate_radps =
          std::max(off.rate_radps, std::abs(output_.state.pendulum_rate_radps - truth.theta_radps));
      off.force_n = std::max(off.force_n, std::abs(output_.state.cart_force_n));
      const double now_s = 1e-3 * static_cast<double>(tick_);
      simulator_.command(now_s, output_.voltage_v);
      simulator_.advance_to(now_s + 1e-3);
    }
    return off;
  }

  const PlantState<double>& truth() const { return simulator_.engine().state(); }
  double voltage_v() const { return output_.voltage_v; }

 private:
  Simulator<double> simulator_;
  Controller controller_;
  ControlOutput output_;
  std::uint64_t tick_ = 0;
};

class ExtendedKalman : public testing::TestWithParam<const char*> {
 protected:
  Plant plant = plant_named(GetParam());
  ControlConfig config = config_of(StateEstimatorKind::extended_kalman);
};

TEST_P(ExtendedKalman, KnowsTheFrictionOfItsPlant) {
  config.friction.share = 0.0;
  const Beside::Off known = Beside(plant, config, plant).go_on(400);
  const Beside::Off unknown = Beside(plant, config_of(StateEstimatorKind::kalman), plant).go_on(400);
  EXPECT_LT(known.force_n, 0.05);
  EXPECT_GT(unknown.force_n, 0.3);
  EXPECT_LT(known.velocity_mps, 2e-3);
  EXPECT_LT(10.0 * known.velocity_mps, unknown.velocity_mps);
}

/// One effect after the other beside the plant's own friction; the estimate stays the truth.
TEST_P(ExtendedKalman, UsesEveryEffectThatThePlantFileHas) {
  config.friction.share = 0.0;
  for (const EffectInfo& effect : effect_registry()) {
    Plant with = plant;
    if (with.find(effect.kind) != nullptr) continue;
    std::vector<double> values;
    for (const ParameterInfo& parameter : effect.parameters) values.push_back(parameter.typical);
    with.set(effect_number(effect.kind), values);
    if (!fault_of(with).empty()) continue;
    Beside run(with, config, with);
    const Beside::Off off = run.go_on(300);
    EXPECT_LT(off.force_n, 0.1) << effect.kind;
    EXPECT_LT(off.velocity_mps, 5e-3) << effect.kind;
    EXPECT_LT(off.rate_radps, 2e-2) << effect.kind;
  }
}

TEST_P(ExtendedKalman, FollowsTheWholeActuatorChain) {
  config.friction.share = 0.0;
  plant.set("motor_lag", {0.01});
  plant.set("input_delay", {0.0035});
  plant.set("voltage_gain", {0.9});
  plant.set("voltage_offset", {0.2});
  plant.set("voltage_dead_zone", {0.1});
  plant.set("voltage_saturation", {3.0});
  const Beside::Off off = Beside(plant, config, plant).go_on(400);
  EXPECT_LT(off.force_n, 0.05);
  EXPECT_LT(off.velocity_mps, 2e-3);
}

TEST_P(ExtendedKalman, CorrectsAnEncoderThatErrsOncePerTurn) {
  config.friction.share = 0.0;
  const Plant even = plant;
  plant.set("encoder_eccentricity", {0.1, 0.02, 0.5});
  const Beside::Off known = Beside(plant, config, plant).go_on(400);
  const Beside::Off unknown = Beside(plant, config, even).go_on(400);
  EXPECT_LT(known.velocity_mps, 2e-3);
  EXPECT_GT(unknown.velocity_mps, 5.0 * known.velocity_mps);
}

TEST_P(ExtendedKalman, PredictsThroughMissingReadings) {
  Beside whole(plant, config, plant), holed(plant, config, plant);
  whole.go_on(300);
  holed.go_on(300, 3);
  EXPECT_NEAR(holed.truth().theta_rad, whole.truth().theta_rad, 1e-3);
  EXPECT_NEAR(holed.truth().cart_m, whole.truth().cart_m, 2e-3);
}

TEST_P(ExtendedKalman, FindsTheForceThatTheFileLacks) {
  config.friction.share = 0.0;
  Plant pushed = plant;
  pushed.set("constant_force", {0.3});
  config.rejection.share = 1.0;
  Beside run(pushed, config, plant);
  run.go_on(150);
  EXPECT_NEAR(run.go_on(1).force_n, 0.3, 0.15);
}

TEST_P(ExtendedKalman, BeginsAnewToTheSameBits) {
  Controller once(config, 15.0, make_model_parts(config, plant, plant)),
      twice(config, 15.0, make_model_parts(config, plant, plant));
  const auto reading = [](std::uint64_t tick) {
    const double t = 1e-3 * static_cast<double>(tick);
    return ControlInput{tick, 0.01 * std::sin(9.0 * t), 0.02 * std::cos(5.0 * t), 0.0};
  };
  for (std::uint64_t tick = 0; tick < 500; ++tick) twice.step(reading(tick));
  twice.reset();
  for (std::uint64_t tick = 0; tick < 500; ++tick)
    EXPECT_EQ(once.step(reading(tick)).voltage_v, twice.step(reading(tick)).voltage_v);
}

TEST_P(ExtendedKalman, BeginsAtRestInAnyTurn) {
  Controller controller(config, 15.0, make_model_parts(config, plant, plant));
  const double turn = 2.0 * std::numbers::pi;
  controller.step({0, 0.0, turn + 0.01, 0.0});
  const ControlOutput output = controller.step({1, 0.0, turn + 0.01, 0.0});
  EXPECT_DOUBLE_EQ(output.state.theta_rad, turn + 0.01);
  EXPECT_NEAR(output.state.pendulum_rate_radps, 0.0, 0.2);
}

INSTANTIATE_TEST_SUITE_P(Plants, ExtendedKalman, testing::Values("exponential", "dynamic"));

/// Bristles far stiffer than a period resolves, and readings that the model cannot follow.
TEST(ExtendedKalmanFilter, StaysFiniteWithBristlesAndWildReadings) {
  Plant plant = plant_named("dynamic");
  plant.set("bristle_friction", {1e6, 3e3});
  const ControlConfig config = config_of(StateEstimatorKind::extended_kalman);
  Beside run(plant, config, plant);
  run.go_on(1000);
  EXPECT_LT(std::abs(run.truth().theta_rad), 0.1);
  Controller controller(config, 15.0, make_model_parts(config, plant, plant));
  for (std::uint64_t tick = 0; tick < 2000; ++tick) {
    const double side = (tick / 7) % 2 == 0 ? 1.0 : -1.0;
    EXPECT_TRUE(std::isfinite(controller.step({tick, 0.3 * side, 3.0 * side, 0.0}).voltage_requested_v));
  }
}

TEST(ExtendedKalmanFilter, WithoutFrictionIsTheStationaryFilter) {
  const Plant viscous = plant_named("viscous");
  ControlConfig extended = config_of(StateEstimatorKind::extended_kalman),
                stationary = config_of(StateEstimatorKind::kalman);
  extended.state_estimator.cart_force_noise_n2_per_s = stationary.state_estimator.cart_force_noise_n2_per_s =
      50.0;
  Beside a(viscous, extended, viscous, 0.005), b(viscous, stationary, viscous, 0.005);
  a.go_on(500);
  b.go_on(500);
  EXPECT_NEAR(a.truth().cart_m, b.truth().cart_m, 2e-6);
  EXPECT_NEAR(a.voltage_v(), b.voltage_v(), 1e-3);
}

TEST(GainFile, HoldsAnExtendedKalmanFilterToTheSameBits) {
  ControlConfig config = config_of(StateEstimatorKind::extended_kalman);
  config.friction = {0.7, 0.004};
  config.state_estimator.plant = "plant.yaml";
  const ControlConfig back = read_gains(YamlMap::from_text(gain_text(config), "gains.yaml"));
  EXPECT_EQ(back.state_estimator.kind, StateEstimatorKind::extended_kalman);
  EXPECT_EQ(back.friction.share, 0.7);
  EXPECT_EQ(back.friction.lag_s, 0.004);
}

TEST(GainFile, RefusesFrictionCompensationWithoutAModelOfFriction) {
  ControlConfig config = config_of(StateEstimatorKind::kalman);
  const std::string text = gain_text(config) + "friction_compensation: {share: 1}\n";
  EXPECT_THROW(read_gains(YamlMap::from_text(text, "gains.yaml")), ConfigError);
}

TEST(EstimatorDesign, RefusesWhatDoesNotHoldAndNamesTheParameter) {
  EstimatorRequest request;
  request.kind = StateEstimatorKind::extended_kalman;
  request.plant_file = plants + "exponential.yaml";
  request.uncertainty = 0.45;
  try {
    design_with_estimator(plant_named("exponential"), request);
    FAIL() << "held with parameters 45 percent off";
  } catch (const ConfigError& refused) {
    EXPECT_NE(std::string(refused.what()).find("pendulum"), std::string::npos) << refused.what();
  }
}

}  // namespace
}  // namespace upright
