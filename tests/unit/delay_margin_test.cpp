#include "design/delay_margin.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <random>

#include "design/characteristic_roots.hpp"
#include "design/gain_design.hpp"
#include "design/linear_sampled_loop.hpp"
#include "runtime/overrun_limit.hpp"
#include "upright/control/controller.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {
namespace {

const std::string config_folder = std::string(UPRIGHT_SOURCE_DIR) + "/config/";

Plant plant_named(const std::string& name) {
  return read_plant_file(config_folder + "plants/" + name + ".yaml");
}

ControlConfig gains_named(const std::string& name) {
  return read_gain_file(config_folder + "gains/" + name + ".yaml");
}

void expect_confirmed(const LoopMargin& margin) {
  EXPECT_TRUE(margin.stable_without_delay);
  ASSERT_TRUE(margin.confirmation);
  EXPECT_TRUE(margin.confirmation->confirmed);
}

TEST(ContinuousMargin, ExponentialGainAsInThePaper) {
  const LoopMargin margin =
      continuous_margin(plant_named("exponential"), gains_named("exponential").gains, 100.0);
  EXPECT_NEAR(margin.critical_delay_s, 0.10690, 5e-6);
  EXPECT_NEAR(margin.crossing_radps, 10.230, 5e-4);
  expect_confirmed(margin);
}

TEST(ContinuousMargin, ExponentialGainOnViscousFrictionAlone) {
  const LoopMargin margin =
      continuous_margin(plant_named("viscous"), gains_named("exponential").gains, 100.0);
  EXPECT_NEAR(margin.critical_delay_s, 0.01536, 5e-6);
  expect_confirmed(margin);
}

TEST(ContinuousMargin, ViscousGainOnItsOwnModel) {
  const LoopMargin margin = continuous_margin(plant_named("viscous"), gains_named("viscous").gains, 100.0);
  EXPECT_NEAR(margin.critical_delay_s, 0.0459, 5e-5);
}

TEST(ContinuousMargin, DynamicGainPrintedAndWhole) {
  const Plant plant = plant_named("dynamic");
  Gains gains = gains_named("dynamic").gains;
  EXPECT_NEAR(continuous_margin(plant, gains, 100.0).critical_delay_s, 0.1072, 5e-5);
  gains.cart_position_v_per_m = 170.17;
  const LoopMargin whole = continuous_margin(plant, gains, 100.0);
  EXPECT_NEAR(whole.critical_delay_s, 0.1160, 5e-5);
  EXPECT_NEAR(whole.crossing_radps, 9.633, 5e-4);
  expect_confirmed(whole);
}

TEST(ContinuousMargin, InputDelayOfThePlantCountsInFull) {
  Plant plant = plant_named("viscous");
  const Gains gains = gains_named("viscous").gains;
  const double without = continuous_margin(plant, gains, 100.0).critical_delay_s;
  plant.set("input_delay", {0.012});
  const LoopMargin margin = continuous_margin(plant, gains, 100.0);
  EXPECT_NEAR(margin.critical_delay_s, without - 0.012, 1e-9);
  expect_confirmed(margin);
}

TEST(ContinuousMargin, SaysWhenTheLoopIsUnstableAnyway) {
  Gains gains = gains_named("viscous").gains;
  gains.pendulum_angle_v_per_rad = -gains.pendulum_angle_v_per_rad;
  const LoopMargin margin = continuous_margin(plant_named("viscous"), gains, 100.0);
  EXPECT_FALSE(margin.stable_without_delay);
  EXPECT_EQ(margin.critical_delay_s, 0.0);
}

TEST(CharacteristicRoots, KnownAnswers) {
  // s' = -V, V = s(t - delay): stable up to pi/2, where the root is at j.
  DelayedFeedback loop{Eigen::MatrixXd::Zero(1, 1), -Eigen::VectorXd::Ones(1), Eigen::RowVectorXd::Ones(1)};
  const auto critical = rightmost_root(loop, std::numbers::pi / 2.0);
  EXPECT_NEAR(critical.real(), 0.0, 1e-10);
  EXPECT_NEAR(critical.imag(), 1.0, 1e-10);
  // At delay 1/e the two real roots meet at -e; just before it, s = -e^(-s delay) has the Lambert W answer.
  const auto root = rightmost_root(loop, 0.3);
  EXPECT_NEAR(root.real() + std::exp(-0.3 * root.real()), 0.0, 1e-10);
  EXPECT_NEAR(root.imag(), 0.0, 1e-10);
}

/// StepwiseSelection over the second half of a linear loop's motion, from small states, of the simulator
/// against the prediction.
double growth(const Plant& plant, const ControlConfig& config, double duration_s) {
  Controller controller(config, 1e6);
  Simulator<double> simulator(make_model<double>(plant));
  PlantState<double> begin{};
  begin.theta_rad = 1e-7;
  simulator.start(begin);
  const double period_s = config.period_s();
  const auto ticks = static_cast<std::uint64_t>(duration_s / period_s);
  double early = 0.0, late = 0.0;
  for (std::uint64_t k = 0; k < ticks; ++k) {
    const Outputs<double> y = simulator.engine().outputs();
    if (k > ticks / 2 && k <= 3 * ticks / 4) early = std::max(early, std::abs(y.theta_rad));
    if (k > 3 * ticks / 4) late = std::max(late, std::abs(y.theta_rad));
    const double now_s = static_cast<double>(k) * period_s;
    simulator.command(now_s, controller.step({k, y.cart_m, y.theta_rad, 0.0}).voltage_v);
    simulator.advance_to(now_s + period_s);
  }
  return std::log(late / early) / (duration_s / 4.0);
}

class SampledMarginOf : public testing::TestWithParam<unsigned> {};

/// The loop itself, run just below and just above the delay: decays, and grows, at the rate of the roots.
TEST_P(SampledMarginOf, SimulationDecaysBelowAndGrowsAbove) {
  std::mt19937 random(GetParam());
  std::uniform_real_distribution<double> spread(0.7, 1.4);
  Plant plant = plant_named("viscous");
  plant.cart_mass_kg *= spread(random);
  plant.pendulum->length_to_com_m *= spread(random);
  plant.set("viscous_friction", {3.0 * spread(random)});
  if (GetParam() % 3 == 1) plant.set("input_delay", {0.0034});
  if (GetParam() % 3 == 2) plant.set("motor_lag", {0.004});
  ControlConfig config = gains_named("viscous");
  const auto k = design_gains(plant, {}, 100.0).gains;
  config.gains = {k[0], k[1], k[2], k[3]};
  config.sample_rate_hz = GetParam() % 2 == 0 ? 1000.0 : 200.0;
  if (GetParam() % 4 == 3) config.estimator.kind = EstimatorKind::difference;
  const LoopMargin margin = sampled_margin(plant, config, 100.0);
  expect_confirmed(margin);
  const LinearSampledLoop loop(plant, config, 100.0);
  for (const double part : {0.97, 1.03}) {
    config.delay_s = part * margin.critical_delay_s;
    const double expected = loop.rightmost_root(config.delay_s).real();
    const double found = growth(plant, config, 12.0);
    EXPECT_EQ(found > 0.0, part > 1.0);
    EXPECT_NEAR(found, expected, 0.05 * std::abs(expected) + 0.02) << "delay " << config.delay_s;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, SampledMarginOf, testing::Range(0u, 12u));

TEST(SampledMargin, TendsToTheContinuousOneAtHighRates) {
  ControlConfig config = gains_named("viscous");
  config.sample_rate_hz = 20000.0;
  config.estimator.cutoff_hz = 5000.0;
  const Plant plant = plant_named("viscous");
  const double continuous = continuous_margin(plant, config.gains, 100.0).critical_delay_s;
  const double sampled = sampled_margin(plant, config, 100.0, false).critical_delay_s;
  EXPECT_NEAR(sampled, continuous, 5e-3 * continuous);
}

TEST(SampledMargin, LoopWithPredictorIsTheUndelayedOne) {
  const Plant plant = plant_named("viscous");
  ControlConfig config = gains_named("viscous");
  config.delay_s = 0.1;
  const SampledDesign sampled = design_sampled_gains(plant, {}, 100.0, config.sample_rate_hz, config.delay_s);
  const auto& k = sampled.design.gains;
  config.gains = {k[0], k[1], k[2], k[3]};
  config.compensation = {CompensationKind::predictor, config_folder + "plants/viscous.yaml"};
  const LinearSampledLoop loop(plant, config, 100.0);
  // With an exact model the delay leaves the poles where the design put them.
  EXPECT_NEAR(std::abs(loop.rightmost_root(0.0) - sampled.design.closed_loop_poles.front()), 0.0, 1e-3);
  const LoopMargin margin = sampled_margin(plant, config, 100.0);
  expect_confirmed(margin);
  EXPECT_GT(margin.critical_delay_s, 0.101);
}

TEST(OverrunTolerance, CountsPeriodsWithinTheSlidingMargin) {
  const OverrunTolerance tolerance =
      overrun_tolerance(plant_named("exponential"), gains_named("exponential"));
  const double sliding =
      sampled_margin(plant_named("viscous"), gains_named("exponential"), 100.0, false).critical_delay_s;
  EXPECT_TRUE(tolerance.stabilized);
  EXPECT_FALSE(tolerance.exceeded());
  EXPECT_NEAR(tolerance.extra_delay_s, sliding, 1e-9);
  EXPECT_EQ(tolerance.missed_periods, static_cast<int>(std::ceil(sliding * 1000.0)) - 1);
  EXPECT_NE(tolerance.sentence.find("consecutive missed periods"), std::string::npos);
}

TEST(OverrunTolerance, NothingIsLeftBeyondTheSlidingMargin) {
  ControlConfig config = gains_named("exponential");
  for (const double delay_s : {0.0145, 0.020, 0.05, 0.2}) {
    config.delay_s = delay_s;
    const OverrunTolerance tolerance = overrun_tolerance(plant_named("exponential"), config);
    EXPECT_TRUE(tolerance.stabilized);
    EXPECT_TRUE(tolerance.exceeded());
    EXPECT_EQ(tolerance.missed_periods, 0);
    EXPECT_NEAR(tolerance.critical_delay_s, 0.01415, 5e-5);
  }
}

TEST(OverrunTolerance, CoggingWhereTheCartStandsDoesNotDecide) {
  Plant plant = plant_named("exponential");
  const OverrunTolerance smooth = overrun_tolerance(plant, gains_named("exponential"));
  for (const double phase_rad : {0.0, std::numbers::pi}) {
    plant.set("cogging_force", {2.0, 0.02, phase_rad});
    EXPECT_NEAR(overrun_tolerance(plant, gains_named("exponential")).extra_delay_s, smooth.extra_delay_s,
                1e-9);
  }
}

TEST(OverrunLimit, OnlyTightensAsTheDelayGrows) {
  ControlConfig config = gains_named("exponential");
  std::uint64_t before = 1000;
  for (double delay_s = 0.0; delay_s < 0.12; delay_s += 0.001) {
    config.delay_s = delay_s;
    const OverrunLimit limit = overrun_limit(plant_named("exponential"), config);
    EXPECT_LE(limit.max_periods_late, before) << delay_s;
    EXPECT_EQ(limit.warning.empty(), delay_s < 0.01415) << delay_s << limit.warning;
    before = limit.max_periods_late;
  }
  EXPECT_EQ(before, 3u);
}

TEST(OverrunLimit, WithoutAModelIsTighterAndSaysSo) {
  ControlConfig config = gains_named("exponential");
  const OverrunLimit limit = overrun_limit(std::nullopt, config);
  EXPECT_FALSE(limit.tolerance);
  EXPECT_EQ(limit.max_periods_late, 10u);
  EXPECT_NE(limit.sentence.find("unknown"), std::string::npos) << limit.sentence;
  EXPECT_EQ(limit.warning, "");
  config.sample_rate_hz = 100.0;
  EXPECT_EQ(overrun_limit(std::nullopt, config).max_periods_late, 3u);
}

TEST(OverrunLimit, UnstableGainsAreToldFromADelayThatIsTooLong) {
  ControlConfig config = gains_named("exponential");
  config.gains.pendulum_angle_v_per_rad *= -1.0;
  const OverrunLimit limit = overrun_limit(plant_named("exponential"), config);
  ASSERT_TRUE(limit.tolerance);
  EXPECT_FALSE(limit.tolerance->stabilized);
  EXPECT_EQ(limit.max_periods_late, 3u);
  EXPECT_NE(limit.warning.find("do not stabilize"), std::string::npos) << limit.warning;
}

}  // namespace
}  // namespace upright
