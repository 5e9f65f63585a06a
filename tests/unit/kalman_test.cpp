// The stationary Kalman filter: what it converges to, its noise, missing readings, the actuator chain, files.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "control/kalman_filter.hpp"
#include "design/delay_margin.hpp"
#include "design/estimator_design.hpp"
#include "design/linear_sampled_loop.hpp"
#include "upright/base/error.hpp"
#include "upright/control/controller.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {
namespace {

const std::string plants = UPRIGHT_SOURCE_DIR "/config/plants/";

ControlConfig quiet_config(const Plant& plant, std::optional<double> delay_s = std::nullopt) {
  EstimatorRequest request;
  request.plant_file = plants + "viscous.yaml";
  request.delay_s = delay_s;
  return design_with_estimator(plant, request).config;
}

Plant viscous() {
  return read_plant_file(plants + "viscous.yaml");
}

/// The filter beside a plant under a voltage that wriggles about zero and keeps it near upright for a while.
class FilterBesidePlant {
 public:
  FilterBesidePlant(const Plant& plant, const ControlConfig& config, const Plant& model)
      : simulator_(make_model<double>(plant)),
        controller_(config, 15.0, make_model_parts(config, model, model)) {
    PlantState<double> state{};
    state.theta_rad = 0.01;
    simulator_.start(state);
  }

  /// The step after `periods` more of closed loop; every `miss`th reading is missing.
  ControlOutput go_on(int periods, int miss = 0) {
    ControlOutput output;
    for (int i = 0; i < periods; ++i, ++tick_) {
      const Outputs<double> y = simulator_.engine().outputs();
      if (miss == 0 || tick_ % static_cast<std::uint64_t>(miss) != 1)
        output = controller_.step({tick_, y.cart_m, y.theta_rad, 0.0});
      const double now_s = 1e-3 * static_cast<double>(tick_);
      simulator_.command(now_s, output.voltage_v);
      simulator_.advance_to(now_s + 1e-3);
    }
    return output;
  }

  const PlantState<double>& truth() const { return simulator_.engine().state(); }

 private:
  Simulator<double> simulator_;
  Controller controller_;
  std::uint64_t tick_ = 0;
};

TEST(KalmanFilter, FindsAConstantForceAndTakesItAway) {
  Plant plant = viscous();
  plant.set("constant_force", {0.4});
  FilterBesidePlant run(plant, quiet_config(viscous()), viscous());
  const ControlOutput output = run.go_on(8000);
  EXPECT_NEAR(output.state.cart_force_n, 0.4, 1e-3);
  EXPECT_NEAR(output.voltage_v, -0.4 / 1.7189, 1e-2);
  EXPECT_NEAR(run.truth().cart_m, 0.0, 1e-3);
}

TEST(KalmanFilter, FindsAWrongZeroOfTheAngle) {
  Plant plant = viscous();
  plant.set("angle_offset", {0.0087});
  FilterBesidePlant run(plant, quiet_config(viscous()), viscous());
  run.go_on(60000);
  EXPECT_NEAR(run.truth().cart_m, 0.0, 1e-3);
}

TEST(KalmanFilter, VelocitiesAreThePlantsWithItsWholeActuatorChain) {
  Plant plant = viscous();
  plant.set("motor_lag", {0.01});
  plant.set("input_delay", {0.0035});
  plant.set("voltage_gain", {0.9});
  plant.set("voltage_offset", {0.2});
  plant.set("voltage_saturation", {3.0});
  FilterBesidePlant run(plant, quiet_config(plant), plant);
  run.go_on(150);
  const ControlOutput output = run.go_on(1);
  // The output is of the beginning of the period that the plant has gone through since.
  EXPECT_NEAR(output.state.cart_velocity_mps, run.truth().cart_mps, 5e-3);
  EXPECT_NEAR(output.state.pendulum_rate_radps, run.truth().theta_radps, 2e-2);
  EXPECT_LT(std::abs(output.state.cart_force_n), 0.05);
}

TEST(KalmanFilter, PredictsThroughMissingReadings) {
  FilterBesidePlant whole(viscous(), quiet_config(viscous()), viscous()),
      holed(viscous(), quiet_config(viscous()), viscous());
  whole.go_on(300);
  holed.go_on(300, 3);
  EXPECT_NEAR(holed.truth().theta_rad, whole.truth().theta_rad, 2e-4);
  EXPECT_NEAR(holed.truth().cart_m, whole.truth().cart_m, 2e-4);
}

TEST(KalmanFilter, BeginsAtRestInAnyTurn) {
  const ControlConfig config = quiet_config(viscous());
  Controller controller(config, 15.0, make_model_parts(config, viscous(), viscous()));
  const double turn = 2.0 * std::numbers::pi;
  controller.step({0, 0.0, turn + 0.01, 0.0});
  const ControlOutput output = controller.step({1, 0.0, turn + 0.01, 0.0});
  EXPECT_DOUBLE_EQ(output.state.theta_rad, turn + 0.01);
  // From the first voltage on the pendulum falls a little; a turn taken for an angle would be hundreds.
  EXPECT_NEAR(output.state.pendulum_rate_radps, 0.0, 0.2);
}

TEST(KalmanFilter, GainIsThatOfTheRiccatiEquationIterated) {
  const Plant plant = viscous();
  const ControlConfig config = quiet_config(plant);
  const ContinuousModel model = continuous_model(plant);
  const ProcessNoise noise = process_noise_of(config.state_estimator, plant);
  const auto gain = kalman_gain(model, noise, config.state_estimator, 1e-3);
  // The same by iterating the filter's covariance over many periods, in quarters of a period for its noise.
  FilterMatrix covariance = 1e-3 * FilterMatrix::Identity();
  covariance.row(filter_motor).setZero();
  covariance.col(filter_motor).setZero();
  const FilterMatrix part = step_over(model, 2.5e-4).a;
  FilterVector w = FilterVector::Zero();
  w(filter_cart_velocity) = noise.cart_m2_per_s3;
  w(filter_pendulum_rate) = noise.pendulum_rad2_per_s3;
  w(filter_cart_force) = noise.cart_force_n2_per_s;
  w(filter_angle_zero) = noise.angle_zero_rad2_per_s;
  const auto shows = shown_positions();
  const Resolution q = resolution_of(config.state_estimator);
  const Eigen::Matrix2d rounding =
      Eigen::Vector2d(q.cart_m * q.cart_m / 12.0,
                      q.angle_rad * q.angle_rad * config.state_estimator.angle_noise_counts2.value())
          .asDiagonal();
  Eigen::Matrix<double, filter_states, 2> iterated;
  const FilterMatrix half_noise = 1.25e-4 * FilterMatrix(w.asDiagonal());
  for (int i = 0; i < 60000; ++i) {
    for (int j = 0; j < 4; ++j) {
      covariance = (part * (covariance + half_noise) * part.transpose() + half_noise).eval();
    }
    const Eigen::Matrix2d spread = shows * covariance * shows.transpose() + rounding;
    iterated = covariance * shows.transpose() * spread.inverse();
    covariance = (covariance - iterated * shows * covariance).eval();
    covariance = (0.5 * (covariance + covariance.transpose())).eval();
  }
  for (Eigen::Index i = 0; i < filter_states; ++i)
    for (Eigen::Index j = 0; j < 2; ++j)
      EXPECT_NEAR(gain(i, j), iterated(i, j), 2e-3 * gain.col(j).norm() + 2e-3 * std::abs(gain(i, j)))
          << i << ", " << j;
}

TEST(EstimatorMargin, RootsAndTransferAgreeOnBothKindsOfDelay) {
  for (const std::optional<double>& delay_s : {std::optional<double>(), std::optional<double>(0.03)}) {
    const ControlConfig config = quiet_config(viscous(), delay_s);
    for (const ExtraDelay extra : {ExtraDelay::known, ExtraDelay::unmodelled}) {
      const LoopMargin margin = sampled_margin(viscous(), config, 100.0, true, extra);
      ASSERT_TRUE(margin.stable_without_delay);
      ASSERT_TRUE(margin.confirmation);
      EXPECT_TRUE(margin.confirmation->confirmed) << margin.critical_delay_s;
      EXPECT_GE(margin.critical_delay_s - config.delay_s, 0.002);
    }
  }
}

TEST(EstimatorMargin, ContinuousIsConfirmedAndNotFarFromSampled) {
  const ControlConfig config = quiet_config(viscous());
  const LoopMargin continuous = continuous_margin(viscous(), config, 100.0);
  ASSERT_TRUE(continuous.confirmation);
  EXPECT_TRUE(continuous.confirmation->confirmed);
  const LoopMargin sampled = sampled_margin(viscous(), config, 100.0, false);
  EXPECT_NEAR(sampled.critical_delay_s, continuous.critical_delay_s, 2e-3);
}

TEST(EstimatorMargin, LinearLoopIsTheControllerThatRuns) {
  // The linear loop's states against the controller with its plant, both from a lean of the pendulum.
  const ControlConfig config = quiet_config(viscous());
  const LinearSampledLoop loop(viscous(), config, 100.0);
  const double decay = loop.rightmost_root(0.0).real();
  ASSERT_LT(decay, 0.0);
  FilterBesidePlant run(viscous(), config, viscous());
  run.go_on(3000);
  const double early = std::abs(run.truth().cart_m);
  run.go_on(3000);
  EXPECT_LT(std::abs(run.truth().cart_m), early + 1e-6);
}

TEST(EstimatorDesign, RefusesWhatNoForceNoiseMends) {
  EstimatorRequest request;
  request.plant_file = plants + "viscous.yaml";
  request.rate_hz = 4.0;
  request.weights = {{1e9, 0.0, 0.0, 0.0}, 1e-9};
  EXPECT_THROW(design_with_estimator(viscous(), request), ConfigError);
}

TEST(EstimatorDesign, NamesTheParameterThatALoopDoesNotBear) {
  ControlConfig config = quiet_config(viscous());
  EXPECT_EQ(destabilising_parameter(viscous(), config, 0.2), "");
  EXPECT_NE(destabilising_parameter(viscous(), config, 0.9), "");
}

TEST(GainFile, AngleNoiseWithoutAKeyIsThatOfRounding) {
  StateEstimatorConfig absent, given;
  given.angle_noise_counts2 = 1.0 / 12.0;
  const ContinuousModel model = continuous_model(viscous());
  const ProcessNoise noise = process_noise_of(absent, viscous());
  EXPECT_EQ(kalman_gain(model, noise, absent, 1e-3), kalman_gain(model, noise, given, 1e-3));
  given.angle_noise_counts2 = 0.6;
  EXPECT_LT(kalman_gain(model, noise, given, 1e-3)(filter_theta, 1),
            kalman_gain(model, noise, absent, 1e-3)(filter_theta, 1));
}

TEST(GainFile, HoldsAStateEstimatorToTheSameBits) {
  ControlConfig config = quiet_config(viscous(), 0.05);
  config.state_estimator.cart_resolution_m = 1.0 / 3.0e4;
  config.rejection.share = 0.7;
  const ControlConfig back = read_gains(YamlMap::from_text(gain_text(config), "gains.yaml"));
  EXPECT_EQ(back.state_estimator.kind, config.state_estimator.kind);
  EXPECT_EQ(back.state_estimator.cart_force_noise_n2_per_s, config.state_estimator.cart_force_noise_n2_per_s);
  EXPECT_EQ(back.state_estimator.cart_resolution_m, config.state_estimator.cart_resolution_m);
  EXPECT_EQ(back.state_estimator.angle_resolution_rad, std::nullopt);
  EXPECT_EQ(back.state_estimator.angle_noise_counts2, config.state_estimator.angle_noise_counts2);
  EXPECT_EQ(back.rejection.share, 0.7);
  EXPECT_EQ(back.rejection.decay_s, config.rejection.decay_s);
}

TEST(GainFile, RefusesRejectionWithoutAnEstimator) {
  const std::string text =
      "gains: {cart_position_v_per_m: 1, pendulum_angle_v_per_rad: 1, cart_velocity_v_per_mps: 1, "
      "pendulum_rate_v_per_radps: 1}\ndelay_s: 0\nsample_rate_hz: 1000\n"
      "velocity_estimator: {kind: difference}\ndisturbance_rejection: {share: 1}\n";
  EXPECT_THROW(read_gains(YamlMap::from_text(text, "gains.yaml")), ConfigError);
}

}  // namespace
}  // namespace upright
