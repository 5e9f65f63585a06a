// Data in which the effect is hidden: made by the CVODE reference engine with true events, not by the engine
// that fits (tests/blind). Quantised encoders, base parameters a few percent off, the voltages recorded as
// commanded. The diagnosis sees the runs only. Hundreds of cases more: tests/bench/diagnosis_matrix.
#include "upright/diagnosis/diagnosis.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "blind_case.hpp"
#include "design/gain_design.hpp"
#include "upright/base/error.hpp"

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

/// Three runs with the pendulum hanging: a multisine, a square wave that grows and then
/// coasts, a multisine.
std::vector<Measurement> hanging_runs(const blind::Rig& rig, unsigned seed, double duration_s = 5.0) {
  std::vector<Measurement> runs;
  for (unsigned r = 0; r < 3; ++r) {
    blind::Plan plan;
    plan.experiment = r % 2 == 0 ? blind::Experiment::multisine : blind::Experiment::square;
    plan.rate_hz = 250.0;
    plan.duration_s = duration_s;
    plan.swing_rad = 0.3;
    plan.seed = 100 * seed + r;
    runs.push_back(measure(rig, plan, std::string("run").append(std::to_string(r))));
  }
  return runs;
}

struct Hidden {
  std::string kind;
  std::vector<double> values;
};

Diagnosis diagnose_hidden(const std::vector<Hidden>& hidden, unsigned seed, double duration_s = 5.0) {
  std::mt19937_64 random(seed);
  blind::Rig rig{.plant = true_plant(random)};
  for (const Hidden& effect : hidden) rig.plant.set(effect_number(effect.kind), effect.values);
  return diagnose(believed_plant(), hanging_runs(rig, seed, duration_s));
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
                         testing::Values(Hidden{"coulomb_friction", {0.3}},
                                         Hidden{"voltage_dead_zone", {0.2}}, Hidden{"input_delay", {0.006}},
                                         Hidden{"voltage_saturation", {1.8}},
                                         Hidden{"pivot_viscous_friction", {0.002}},
                                         Hidden{"friction_asymmetry", {0.4}},
                                         Hidden{"drive_compliance", {1e-4}}),
                         [](const auto& test) { return test.param.kind; });

TEST(Diagnosis, NamesAConstantForceWithItsIndistinguishableEffects) {
  const Diagnosis d = diagnose_hidden({{"constant_force", {0.3}}}, 12, 8.0);
  ASSERT_FALSE(d.effects.empty());
  const FoundEffect& first = d.effects.front();
  std::vector<std::string> set = {std::string(effect_registry()[first.effect].kind)};
  for (const std::size_t other : first.indistinguishable_from)
    set.emplace_back(effect_registry()[other].kind);
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

TEST(Diagnosis, FindsWhatOnlyTheEndOfOneRunShows) {
  std::mt19937_64 random(17);
  blind::Rig rig{.plant = true_plant(random)};
  rig.plant.set("pivot_quadratic_drag", {0.0007});
  blind::Plan plan;
  plan.experiment = blind::Experiment::balance;
  plan.duration_s = 6.0;
  plan.gains = design_gains(believed_plant(), {}, 100.0).gains;
  plan.swing_rad = 0.02;
  plan.let_go_s = 3.5;
  const Diagnosis d = diagnose(believed_plant(), {measure(rig, plan, "run")});
  EXPECT_EQ(d.verdict, Verdict::explained) << d.residual;
  ASSERT_FALSE(d.effects.empty());
  EXPECT_EQ(effect_registry()[d.effects.front().effect].kind, "pivot_quadratic_drag");
}

TEST(Diagnosis, NamesNoEffectWhereNoneIsHidden) {
  const Diagnosis d = diagnose_hidden({}, 14);
  for (const FoundEffect& found : d.effects) EXPECT_TRUE(is_correction(found.effect));
  EXPECT_LT(d.gap_after, 1.1);
}

TEST(Diagnosis, SaysNoDiscrepancyOfAPlantThatIsRight) {
  const Diagnosis d = diagnose(believed_plant(), hanging_runs({.plant = believed_plant()}, 15));
  EXPECT_EQ(d.verdict, Verdict::no_discrepancy) << testing::PrintToString(d.notes);
  EXPECT_TRUE(d.effects.empty());
}

TEST(Diagnosis, KeepsASpringThatThePlantFileHasHoweverFarItsMiddle) {
  std::mt19937_64 random(19);
  blind::Rig rig{.plant = true_plant(random)};
  Plant believed = believed_plant();
  believed.set("cable_spring", {0.2, -2.0});
  rig.plant.set("cable_spring", {0.8, -2.0});
  const Diagnosis d = diagnose(believed, hanging_runs(rig, 19));
  EXPECT_EQ(d.verdict, Verdict::explained) << d.residual;
  ASSERT_FALSE(d.steps.empty());
  EXPECT_EQ(effect_registry()[d.steps.front().effects.front().effect].kind, "cable_spring");
  ASSERT_NE(d.model.find("cable_spring"), nullptr);
  EXPECT_NEAR(d.model.find("cable_spring")->values[0] * (d.model.find("cable_spring")->values[1]), -1.6, 0.1);
}

TEST(Diagnosis, NamesASpringWhoseMiddleIsNowhereNearAConstantForce) {
  const Diagnosis d = diagnose_hidden({{"cable_spring", {0.05, -8.0}}}, 20);
  EXPECT_EQ(d.verdict, Verdict::explained) << d.residual;
  ASSERT_FALSE(d.effects.empty());
  EXPECT_EQ(effect_registry()[d.effects.front().effect].kind, "constant_force");
  EXPECT_NEAR(d.effects.front().parameters[0].value, -0.4, 0.02);
}

/// Whether the answer says that no known effect accounts for the data.
bool is_recognised(const Diagnosis& diagnosis) {
  return diagnosis.verdict == Verdict::unexplained || diagnosis.verdict == Verdict::described;
}

TEST(Diagnosis, DoesNotExplainBacklash) {
  std::mt19937_64 random(16);
  const blind::Rig rig{.plant = true_plant(random), .unknown = blind::Unknown::encoder_play, .play_m = 2e-3};
  EXPECT_TRUE(is_recognised(diagnose(believed_plant(), hanging_runs(rig, 16))));
}

/// A case of the matrix: experiments, rate, number and length of runs, falls and gaps follow from the seed.
struct BlindCase {
  std::vector<std::string> hidden;
  blind::Size size = blind::Size::typical;
  bool disturbed = false;
  std::uint64_t seed = 1;
};

class Blind : public testing::TestWithParam<BlindCase> {
 protected:
  void SetUp() override {
    const BlindCase& c = GetParam();
    case_ = blind::make_case(
        {.hidden = c.hidden,
         .size = c.size,
         .seed = c.seed,
         .condition = c.disturbed ? blind::Condition::disturbed : blind::Condition::quantized,
         .max_samples = 4000.0});
    diagnosis_ = diagnose(case_.believed, measure_all(case_));
  }

  /// Effects found that are more than the correction of a number in the plant file.
  std::vector<std::string> structural() const {
    std::vector<std::string> kinds;
    for (const FoundEffect& found : diagnosis_.effects)
      if (!is_correction(found.effect) && case_.believed.find(found.effect) == nullptr)
        kinds.emplace_back(effect_registry()[found.effect].kind);
    return kinds;
  }

  /// What did not reproduce, and where.
  std::vector<std::string> withdrawn() const {
    std::vector<std::string> kinds;
    for (const LocalEffect& local : diagnosis_.helps_here_only)
      kinds.push_back(std::string(effect_registry()[local.effect].kind) + ": " + local.where);
    return kinds;
  }

  /// The first effect and what is declared not to be told from it.
  std::vector<std::string> first_set() const {
    if (diagnosis_.effects.empty()) return {};
    const FoundEffect& first = diagnosis_.effects.front();
    std::vector<std::string> set = {std::string(effect_registry()[first.effect].kind)};
    for (const std::size_t other : first.indistinguishable_from)
      set.emplace_back(effect_registry()[other].kind);
    return set;
  }

  blind::Case case_;
  Diagnosis diagnosis_;
};

std::string name_of_case(const testing::TestParamInfo<BlindCase>& test) {
  std::string name = std::string(name_of(test.param.size)) + "_";
  for (const std::string& kind : test.param.hidden) name.append(kind).append("_");
  if (test.param.hidden.empty()) name.append("none_");
  return name.append(test.param.disturbed ? "disturbed_" : "").append(std::to_string(test.param.seed));
}

class BlindEffect : public Blind {};

TEST_P(BlindEffect, IsNamedWithItsParameter) {
  const std::vector<std::string> set = first_set();
  EXPECT_NE(std::find(set.begin(), set.end(), GetParam().hidden[0]), set.end())
      << case_.campaign << ": " << testing::PrintToString(set);
  const blind::HiddenEffect& hidden = case_.hidden[0];
  const FoundEffect& first = diagnosis_.effects.at(0);
  if (first.effect != hidden.effect) return;
  const ParameterEstimate& found = first.parameters[0];
  const double share = GetParam().disturbed ? 0.15 : 0.05;
  const double half_width = std::max(found.high - found.value, found.value - found.low);
  EXPECT_NEAR(found.value, hidden.values[0], std::max(share * std::abs(hidden.values[0]), half_width));
}

class BlindPair : public Blind {};

TEST_P(BlindPair, IsNamedWhole) {
  const std::vector<std::string> found = structural();
  for (const std::string& kind : GetParam().hidden)
    EXPECT_NE(std::find(found.begin(), found.end(), kind), found.end())
        << testing::PrintToString(found) << testing::PrintToString(withdrawn()) << name_of(diagnosis_.verdict)
        << ": " << diagnosis_.residual << testing::PrintToString(diagnosis_.notes);
}

class BlindNothing : public Blind {};

TEST_P(BlindNothing, IsNotTakenForAnEffect) {
  EXPECT_TRUE(structural().empty()) << case_.campaign << ": " << testing::PrintToString(structural());
}

class BlindUnknown : public Blind {};

TEST_P(BlindUnknown, IsNotExplained) {
  EXPECT_TRUE(is_recognised(diagnosis_)) << testing::PrintToString(structural());
}

using blind::Size;

INSTANTIATE_TEST_SUITE_P(Cases, BlindEffect,
                         testing::Values(BlindCase{{"coulomb_friction"}, Size::typical, true, 201},
                                         BlindCase{{"cogging_force"}, Size::strong, false, 202},
                                         BlindCase{{"pivot_coulomb_friction"}, Size::typical, true, 203},
                                         BlindCase{{"motor_lag"}, Size::strong, false, 204},
                                         BlindCase{{"voltage_offset"}, Size::typical, true, 205},
                                         BlindCase{{"cable_spring"}, Size::typical, true, 206},
                                         BlindCase{{"viscous_asymmetry"}, Size::typical, false, 207},
                                         BlindCase{{"pendulum_length"}, Size::strong, false, 208},
                                         BlindCase{{"quadratic_drag"}, Size::strong, true, 209},
                                         BlindCase{{"warming_friction"}, Size::strong, true, 232},
                                         BlindCase{{"load_dependent_friction"}, Size::typical, true, 233},
                                         // Few moments of the training run show it, the held-out ones do.
                                         BlindCase{
                                             {"position_dependent_friction"}, Size::weak, true, 262000854},
                                         // Only with another part of the run held out it is beyond doubt.
                                         BlindCase{{"bristle_friction"}, Size::weak, true, 272000840}),
                         name_of_case);
INSTANTIATE_TEST_SUITE_P(
    Cases, BlindPair,
    testing::Values(BlindCase{{"coulomb_friction", "cable_spring"}, Size::strong, false, 211},
                    BlindCase{{"input_delay", "pivot_viscous_friction"}, Size::strong, true, 212},
                    // Only the run that is held out at first reaches the limit.
                    BlindCase{{"voltage_saturation", "quadratic_drag"}, Size::typical, false, 191000627}),
    name_of_case);
INSTANTIATE_TEST_SUITE_P(Cases, BlindNothing,
                         testing::Values(BlindCase{{}, Size::typical, false, 221},
                                         BlindCase{{}, Size::typical, true, 222},
                                         BlindCase{{}, Size::typical, true, 223}),
                         name_of_case);
INSTANTIATE_TEST_SUITE_P(Cases, BlindUnknown,
                         testing::Values(BlindCase{{"gusts"}, Size::strong, false, 231},
                                         BlindCase{{"encoder_play"}, Size::strong, true, 234}),
                         name_of_case);

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
