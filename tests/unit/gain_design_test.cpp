#include "design/gain_design.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <numbers>
#include <random>

#include "model/dense_algebra.hpp"
#include "model/riccati.hpp"
#include "upright/base/error.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {
namespace {

Plant plant_named(const std::string& name) {
  return read_plant_file(std::string(UPRIGHT_SOURCE_DIR) + "/config/plants/" + name + ".yaml");
}

void expect_gains(const GainDesign& design, const std::array<double, 4>& expected) {
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(design.gains[i], expected[i], 1e-5 * expected[i]);
  for (const auto& pole : design.closed_loop_poles) EXPECT_LT(pole.real(), 0.0);
  EXPECT_LT(design.residual, 1e-12);
}

TEST(GainDesign, GivesThePapersExponentialGain) {
  const GainDesign design = design_gains(plant_named("exponential"), {}, 100.0);
  expect_gains(design, {70.7107, 304.9270, 143.3150, 61.0832});
  EXPECT_TRUE(design.eliminated.empty());
}

TEST(GainDesign, GivesTheViscousGain) {
  expect_gains(design_gains(plant_named("viscous"), {}, 100.0), {70.7107, 143.2162, 51.3919, 27.1288});
}

TEST(GainDesign, TakesASprungMassAsFixedAndShowsItsPoles) {
  Plant plant = plant_named("viscous"), fixed = plant;
  plant.set("sprung_mass", {0.1, 6.0, 0.05});
  fixed.cart_mass_kg += 0.1;
  const GainDesign design = design_gains(plant, {}, 100.0), of_fixed = design_gains(fixed, {}, 100.0);
  EXPECT_EQ(design.gains, of_fixed.gains);
  EXPECT_EQ(design.closed_loop_poles.size(), of_fixed.closed_loop_poles.size() + 2);
  for (const auto& pole : design.closed_loop_poles) EXPECT_LT(pole.real(), 0.0);
  ASSERT_FALSE(design.notes.empty());
  EXPECT_NE(design.notes.back().find("sprung_mass"), std::string::npos);
}

// Two bodies on one spring swing faster than the mass on a cart at rest.
TEST(LinearPlant, HasTheSwingOfASprungMass) {
  Plant plant = plant_named("viscous");
  plant.pendulum.reset();
  plant.effects.clear();
  plant.motor.back_emf_n_per_mps = 0.0;
  constexpr double sprung_kg = 0.2, frequency_hz = 4.0, damping_ratio = 0.05;
  plant.set("sprung_mass", {sprung_kg, frequency_hz, damping_ratio});
  const LinearPlant linear = linearize(plant, 100.0);
  EXPECT_EQ(linear.states,
            (std::vector<std::string>{"cart_m", "cart_velocity_mps", "attached_m", "attached_mps"}));
  const double both = 1.0 + sprung_kg / plant.cart_mass_kg;
  const double radps = 2.0 * std::numbers::pi * frequency_hz * std::sqrt(both);
  const Eigen::VectorXcd poles = eigenvalues(linear.a);
  EXPECT_NEAR(poles.cwiseAbs().maxCoeff(), radps, 1e-9 * radps);
  EXPECT_NEAR(poles.real().minCoeff(), -damping_ratio * std::sqrt(both) * radps, 1e-9 * radps);
}

TEST(GainDesign, TakesAFlexibleRodAsRigidAndShowsItsPoles) {
  Plant plant = plant_named("viscous");
  const GainDesign rigid = design_gains(plant, {}, 100.0);
  plant.set("flexible_rod", {0.5, 30.0, 0.05});
  const GainDesign design = design_gains(plant, {}, 100.0);
  EXPECT_EQ(design.gains, rigid.gains);
  EXPECT_EQ(design.closed_loop_poles.size(), rigid.closed_loop_poles.size() + 2);
  ASSERT_FALSE(design.notes.empty());
  EXPECT_NE(design.notes.back().find("flexible_rod"), std::string::npos);
}

TEST(GainDesign, EliminatesTheBristleThatTheVoltageCannotMoveAlone) {
  const GainDesign design = design_gains(plant_named("dynamic"), {}, 100.0);
  expect_gains(design, {170.170, 290.499, 136.020, 58.101});
  ASSERT_EQ(design.eliminated.size(), 1u);
  EXPECT_EQ(design.eliminated[0].state, "bristle_m");
  EXPECT_NEAR(std::abs(design.eliminated[0].eigenvalue), 0.0, 1e-9);
  EXPECT_NE(design.eliminated[0].explanation.find("85.085 on cart_m"), std::string::npos);
}

TEST(GainDesign, ActuatorAndSensorScalesMoveIntoTheGains) {
  Plant plant = plant_named("viscous");
  const GainDesign plain = design_gains(plant, {}, 100.0);
  plant.set("angle_scale", {1.25});
  const GainDesign scaled = design_gains(plant, {}, 100.0);
  EXPECT_NEAR(scaled.gains[1], plain.gains[1] / 1.25, 1e-9 * plain.gains[1]);
  EXPECT_NEAR(scaled.gains[0], plain.gains[0], 1e-9 * plain.gains[0]);
}

TEST(GainDesign, MotorLagIsTakenAsQuickAndThePolesShowIt) {
  Plant plant = plant_named("viscous");
  plant.set("motor_lag", {0.005});
  const GainDesign design = design_gains(plant, {}, 100.0);
  EXPECT_EQ(design.closed_loop_poles.size(), 5u);
  EXPECT_EQ(design.eliminated.back().state, "motor_v");
}

TEST(GainDesign, AKinkCountsWithTheMeanOfItsSlopes) {
  Plant plant = plant_named("viscous");
  const GainDesign plain = design_gains(plant, {}, 100.0);
  plant.set("viscous_asymmetry", {0.7});
  plant.set("quadratic_drag", {5.0});
  const GainDesign kinked = design_gains(plant, {}, 100.0);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(kinked.gains[i], plain.gains[i], 1e-9);
}

TEST(GainDesign, CartAloneHasGainsOnTheCartOnly) {
  Plant plant = plant_named("viscous");
  plant.pendulum.reset();
  const GainDesign design = design_gains(plant, {}, 100.0);
  EXPECT_LT(design.gains[0], 0.0);
  EXPECT_EQ(design.gains[1], 0.0);
}

TEST(GainDesign, NamesAndPrintsTheBadMatrix) {
  Plant plant = plant_named("viscous");
  DesignWeights weights;
  weights.q = {0.0, 0.0, 0.0, 0.0};
  try {
    design_gains(plant, weights, 100.0);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("Q = [0 0 0 0; "), std::string::npos) << error.what();
  }
  plant.motor.force_per_volt_n = 0.0;
  EXPECT_THROW(design_gains(plant, {}, 100.0), ConfigError);
}

TEST(SampledDesign, DelayLineEquationAgreesWithThePredictedState) {
  for (const double delay_s : {0.0, 0.004, 0.0215, 0.1}) {
    const SampledDesign sampled = design_sampled_gains(plant_named("viscous"), {}, 100.0, 1000.0, delay_s);
    EXPECT_EQ(sampled.delay_periods, static_cast<int>(std::ceil(delay_s * 1000.0 - 1e-9)));
    EXPECT_LT(sampled.delay_line_difference, 1e-6);
    EXPECT_LT(sampled.design.residual, 1e-9);
    for (const auto& pole : sampled.design.closed_loop_poles) EXPECT_LT(pole.real(), 0.0);
  }
}

TEST(SampledDesign, TendsToTheContinuousGainAtHighRates) {
  const GainDesign continuous = design_gains(plant_named("exponential"), {}, 100.0);
  const SampledDesign sampled = design_sampled_gains(plant_named("exponential"), {}, 100.0, 20000.0, 0.0);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(sampled.design.gains[i], continuous.gains[i], 5e-3 * continuous.gains[i]);
}

/// Random systems with one unstable part at least, all of it within reach of the input.
TEST(GainCost, IsTheSumAlongTheWorstStart) {
  const Plant plant = sliding_plant(plant_named("exponential"));
  const GainCost cost(plant, {}, 100.0, 1000.0);
  const std::array<double, 4> best = design_sampled_gains(plant, {}, 100.0, 1000.0, 0.0).design.gains;
  EXPECT_NEAR(cost.loss(best), 0.0, 1e-9);
  std::array<double, 4> other = best;
  other[0] *= 0.5;
  other[2] *= 0.8;
  const double loss = cost.loss(other);
  EXPECT_GT(loss, 0.0);
  // Witness: the cost summed along the steps of the sampled plant.
  const LinearPlant linear = linearize(plant, 100.0);
  const auto integral = [&](const std::array<double, 4>& gains, const Eigen::Vector4d& start) {
    Eigen::RowVector4d k(gains.data());
    const SampledPlant step = hold_input(linear.a, linear.b * linear.actuator_slope, 1e-3);
    Eigen::Vector4d s = start;
    double sum = 0.0;
    for (int i = 0; i < 20000; ++i) {
      const double volts = k * s;
      sum += 5000.0 * s(0) * s(0) + 3000.0 * s(1) * s(1) + 20.0 * (s(2) * s(2) + s(3) * s(3)) + volts * volts;
      s = step.a * s + step.b * volts;
    }
    return sum;
  };
  // The integral is a quadratic form of the start.
  const auto form = [&](const std::array<double, 4>& gains) {
    const Eigen::Matrix4d unit = Eigen::Matrix4d::Identity();
    Eigen::Matrix4d costs;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        costs(i, j) =
            0.25 * (integral(gains, unit.col(i) + unit.col(j)) - integral(gains, unit.col(i) - unit.col(j)));
    return costs;
  };
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix4d> ratios(form(other), form(best));
  EXPECT_NEAR(loss, ratios.eigenvalues().maxCoeff() - 1.0, 0.01 * loss);
}

TEST(GainCost, IsInfiniteForGainsThatDoNotHoldThePlant) {
  const GainCost cost(sliding_plant(plant_named("viscous")), {}, 100.0, 1000.0);
  EXPECT_TRUE(std::isinf(cost.loss({0.0, 0.0, 0.0, 0.0})));
}

class RandomSystem : public testing::TestWithParam<unsigned> {
 protected:
  std::mt19937 random{GetParam()};
  std::normal_distribution<double> normal;
  Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
  }
};

TEST_P(RandomSystem, ContinuousRiccatiHoldsAndStabilizes) {
  const auto n = static_cast<Eigen::Index>(1 + GetParam() % 7);
  const Eigen::MatrixXd a = matrix(n, n) * 3.0, c = matrix(n, n);
  const Eigen::VectorXd b = matrix(n, 1);
  const Eigen::MatrixXd q = c.transpose() * c;
  const double r = std::exp(normal(random));
  const RiccatiSolution solution = solve_continuous_riccati(a, b, q, r);
  EXPECT_LT(solution.residual, 1e-8);
  const Eigen::MatrixXd closed = a - b * solution.gain;
  EXPECT_LT(eigenvalues(closed).real().maxCoeff(), 0.0);
  const Eigen::MatrixXd& x = solution.x;
  const Eigen::MatrixXd remainder = a.transpose() * x + x * a - x * b * b.transpose() * x / r + q;
  EXPECT_LT(remainder.norm(), 1e-8 * (x * a).norm());
  EXPECT_GT(x.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), -1e-9 * x.norm());
}

TEST_P(RandomSystem, DiscreteRiccatiHoldsAndStabilizes) {
  const auto n = static_cast<Eigen::Index>(1 + GetParam() % 7);
  const Eigen::MatrixXd a = matrix(n, n) * 0.8, c = matrix(n, n);
  const Eigen::VectorXd b = matrix(n, 1);
  const Eigen::MatrixXd q = c.transpose() * c + 0.1 * Eigen::MatrixXd::Identity(n, n);
  const DiscreteRiccatiSolution solution =
      solve_discrete_riccati(a, b, q, Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Identity(1, 1));
  EXPECT_LT(solution.residual, 1e-8);
  const Eigen::MatrixXd closed = a - b * solution.gain;
  EXPECT_LT(eigenvalues(closed).cwiseAbs().maxCoeff(), 1.0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomSystem, testing::Range(0u, 60u));

}  // namespace
}  // namespace upright
