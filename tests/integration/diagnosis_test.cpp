// Data in which the effect is hidden: made by the CVODE reference engine with true events, not by the engine
// that fits. Quantised encoders, base parameters a few percent off, the voltages recorded as commanded. The
// diagnosis sees the runs only.
#include "upright/analysis/diagnosis.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "upright/model/error.hpp"
#include "upright/sim/cvode_engine.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {
namespace {

Plant believed_plant() {
  Plant plant;
  plant.cart_mass_kg = 0.815;
  plant.pendulum = Pendulum{0.21, 0.305, {}};
  plant.gravity_mps2 = 9.8;
  plant.motor = {1.7189, 7.682};
  plant.set("viscous_friction", {3.0});
  return plant;
}

/// The same rig as it really is: every base parameter up to two percent off.
Plant true_plant(std::mt19937_64& random) {
  std::uniform_real_distribution<double> off(0.98, 1.02);
  Plant plant = believed_plant();
  plant.cart_mass_kg *= off(random);
  plant.pendulum->mass_kg *= off(random);
  plant.pendulum->length_to_com_m *= off(random);
  plant.motor.back_emf_n_per_mps *= off(random);
  return plant;
}

double quantised(double value, double step) {
  return step * std::round(value / step);
}

/// Eight seconds with the pendulum hanging: a multisine, or a square wave that grows and then coasts.
Measurement hanging_run(const Plant& plant, int number, std::mt19937_64& random) {
  std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi);
  std::array<double, 6> phases;
  for (double& p : phases) p = phase(random);
  constexpr double period_s = 4e-3;
  Measurement run;
  run.name = "run" + std::to_string(number);
  run.cart_resolution_m = 2.27485e-5;
  run.theta_resolution_rad = 2.0 * std::numbers::pi / 4096.0;
  BasicSimulator<CvodeEngine, double> simulator(make_model<double>(plant));
  PlantState<double> start;
  start.theta_rad = std::numbers::pi + 0.3;
  simulator.start(start);
  for (int k = 0; k < 2000; ++k) {
    const double t = k * period_s;
    const Outputs<double> y = simulator.engine().outputs();
    run.time_s.push_back(t);
    run.cart_m.push_back(quantised(y.cart_m, run.cart_resolution_m));
    run.theta_rad.push_back(quantised(y.theta_rad, run.theta_resolution_rad));
    double volts = -8.0 * run.cart_m.back();
    if (number % 2 == 0) {
      for (std::size_t i = 0; i < phases.size(); ++i)
        volts += 0.9 * std::sin(2.0 * std::numbers::pi * 0.2 * std::pow(1.87, i) * t + phases[i]);
    } else if (t < 7.0) {
      volts += (std::fmod(t, 1.1) < 0.55 ? 1.0 : -1.0) * (1.0 + 0.25 * std::floor(t / 2.0));
    }
    run.voltage_v.push_back(volts);
    simulator.command(t, volts);
    simulator.advance_to(t + period_s);
  }
  return run;
}

struct Hidden {
  std::string kind;
  std::vector<double> values;
};

Diagnosis diagnose_hidden(const std::vector<Hidden>& hidden, unsigned seed) {
  std::mt19937_64 random(seed);
  Plant plant = true_plant(random);
  for (const Hidden& effect : hidden) plant.set(effect_number(effect.kind), effect.values);
  std::vector<Measurement> runs;
  for (int i = 0; i < 3; ++i) runs.push_back(hanging_run(plant, i, random));
  return diagnose(believed_plant(), runs);
}

bool is_correction(std::size_t effect) {
  return effect_registry()[effect].enters == Enters::parameter;
}

class OneHiddenEffect : public testing::TestWithParam<Hidden> {};

TEST_P(OneHiddenEffect, IsNamedFirstWithItsParameterAndTheGapCloses) {
  const Diagnosis d = diagnose_hidden({GetParam()}, 11);
  EXPECT_EQ(d.verdict, Verdict::explained) << d.residual;
  ASSERT_FALSE(d.effects.empty());
  const FoundEffect& first = d.effects.front();
  EXPECT_EQ(effect_registry()[first.effect].kind, GetParam().kind);
  for (std::size_t i = 1; i < d.effects.size(); ++i) EXPECT_TRUE(is_correction(d.effects[i].effect));
  ASSERT_EQ(first.parameters.size(), GetParam().values.size());
  EXPECT_NEAR(first.parameters[0].value, GetParam().values[0], 0.05 * std::abs(GetParam().values[0]));
  EXPECT_LT(d.gap_after, 1.1);
  EXPECT_GT(d.gap_before, 2.0);
}

INSTANTIATE_TEST_SUITE_P(Effects, OneHiddenEffect,
                         testing::Values(Hidden{"coulomb_friction", {0.3}}, Hidden{"quadratic_drag", {1.0}},
                                         Hidden{"voltage_dead_zone", {0.2}}, Hidden{"input_delay", {0.006}},
                                         Hidden{"motor_lag", {0.01}}, Hidden{"voltage_saturation", {1.8}},
                                         Hidden{"cogging_force", {0.3, 0.012, 0.7}},
                                         Hidden{"pivot_viscous_friction", {0.002}}),
                         [](const auto& test) { return test.param.kind; });

TEST(Diagnosis, NamesAConstantForceTogetherWithWhatItCannotBeToldFrom) {
  const Diagnosis d = diagnose_hidden({{"constant_force", {0.3}}}, 12);
  ASSERT_FALSE(d.effects.empty());
  const FoundEffect& first = d.effects.front();
  std::vector<std::string> set = {std::string(effect_registry()[first.effect].kind)};
  for (const std::size_t other : first.confusable_with) set.emplace_back(effect_registry()[other].kind);
  EXPECT_NE(std::find(set.begin(), set.end(), "constant_force"), set.end());
  EXPECT_NE(std::find(set.begin(), set.end(), "voltage_offset"), set.end());
  EXPECT_TRUE(d.next_experiment.has_value());
}

TEST(Diagnosis, FindsStickSlipAsCoulombAndStribeck) {
  const Diagnosis d =
      diagnose_hidden({{"coulomb_friction", {0.43}}, {"stribeck_friction", {0.43, 0.105, 2.0}}}, 13);
  EXPECT_EQ(d.verdict, Verdict::explained) << d.residual;
  const PlantEffect* coulomb = d.model.find("coulomb_friction");
  const PlantEffect* stribeck = d.model.find("stribeck_friction");
  ASSERT_NE(coulomb, nullptr);
  ASSERT_NE(stribeck, nullptr);
  EXPECT_NEAR(coulomb->values[0], 0.43, 0.03);
  EXPECT_NEAR(coulomb->values[0] + stribeck->values[0], 0.86, 0.05);
  EXPECT_LT(d.gap_after, 1.1);
}

TEST(Diagnosis, NamesNoEffectWhereNoneIsHidden) {
  const Diagnosis d = diagnose_hidden({}, 14);
  for (const FoundEffect& found : d.effects) EXPECT_TRUE(is_correction(found.effect));
  EXPECT_LT(d.gap_after, 1.1);
}

TEST(Diagnosis, SaysNoDiscrepancyOfAPlantThatIsRight) {
  std::mt19937_64 random(15);
  std::vector<Measurement> runs;
  for (int i = 0; i < 3; ++i) runs.push_back(hanging_run(believed_plant(), i, random));
  const Diagnosis d = diagnose(believed_plant(), runs);
  EXPECT_EQ(d.verdict, Verdict::no_discrepancy);
  EXPECT_TRUE(d.effects.empty());
}

TEST(Diagnosis, SaysUnexplainedOfBacklash) {
  std::mt19937_64 random(16);
  const Plant plant = true_plant(random);
  std::vector<Measurement> runs;
  for (int i = 0; i < 3; ++i) {
    Measurement run = hanging_run(plant, i, random);
    double shown = 0.0;
    for (double& x : run.cart_m)
      x = quantised(shown = std::clamp(shown, x - 1e-3, x + 1e-3), run.cart_resolution_m);
    runs.push_back(run);
  }
  EXPECT_EQ(diagnose(believed_plant(), runs).verdict, Verdict::unexplained);
}

TEST(Diagnosis, RefusesRunsThatTheModelCannotShow) {
  Plant cart_alone = believed_plant();
  cart_alone.pendulum.reset();
  Measurement run;
  run.time_s = {0.0, 0.1, 0.2};
  run.theta_rad = {0.1, 0.2, 0.3};
  run.voltage_v = {0.0, 0.0, 0.0};
  EXPECT_THROW(diagnose(cart_alone, {run}), ConfigError);
}

}  // namespace
}  // namespace upright
