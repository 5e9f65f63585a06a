// What is left of runs of a rig that the model is not, in words.
#include "diagnosis/residual_tests.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "blind_case.hpp"
#include "diagnosis/plant_scale.hpp"

namespace upright {
namespace {

Plant cart() {
  Plant plant;
  plant.cart_mass_kg = 1.0;
  plant.motor = {1.7, 7.7};
  plant.set("viscous_friction", {3.0});
  return plant;
}

std::vector<Measurement> runs_of(const blind::Rig& rig,
                                 blind::Experiment experiment = blind::Experiment::square) {
  std::vector<Measurement> runs;
  for (unsigned seed = 1; seed <= 2; ++seed) {
    blind::Plan plan;
    plan.experiment = experiment;
    plan.rate_hz = 250.0;
    plan.seed = seed;
    runs.push_back(measure(rig, plan, "run"));
  }
  return runs;
}

std::string what_is_left_of(const blind::Rig& rig) {
  const std::vector<Measurement> runs = runs_of(rig);
  const FitData data{&runs, cut_segments(runs)};
  const FitPoint start{cart(), estimate_initial_states(runs, data.segments, cart()), {.force = 0.1}};
  const InnovationStatistics s = Innovations(data, fit(data, start, {}).point, {}).measured();
  return name_of_residual_probe(s.named_probe, s.is_positive[s.named_probe]);
}

std::string with_compliance(double compliance_m_per_n) {
  blind::Rig rig{.plant = cart(), .disturbance_n = 0.05};
  rig.plant.set("drive_compliance", {compliance_m_per_n});
  return what_is_left_of(rig);
}

TEST(Structure, TellsOnWhichSideOfTheEncoderADriveGivesWay) {
  const std::string near = with_compliance(5e-5), far = with_compliance(-5e-5);
  EXPECT_NE(near.find("between the encoder and the cart"), std::string::npos) << near;
  EXPECT_NE(far.find("between the motor and the encoder"), std::string::npos) << far;
}

/// The same cart on a planet with ten times the gravity, a hundred times as heavy and ten times as long: all
/// speeds and voltages are ten times as large, and forces a thousand times.
Plant large_cart() {
  Plant plant = cart();
  plant.gravity_mps2 *= 10.0;
  plant.cart_mass_kg *= 100.0;
  plant.motor = {170.0, 770.0};
  plant.set("viscous_friction", {300.0});
  return plant;
}

std::vector<Measurement> enlarged(std::vector<Measurement> runs) {
  for (Measurement& run : runs) {
    for (std::vector<double>* values : {&run.cart_m, &run.voltage_v})
      for (double& value : *values) value *= 10.0;
    run.cart_resolution_m *= 10.0;
    if (run.known_cart_noise_m) *run.known_cart_noise_m *= 10.0;
  }
  return runs;
}

/// What is left at the plant as given, with a white force of this intensity.
InnovationStatistics left_of(const std::vector<Measurement>& runs, const Plant& plant, double force,
                             const SelectionPolicy& policy) {
  const FitData data{&runs, cut_segments(runs)};
  const FitPoint given{plant, estimate_initial_states(runs, data.segments, plant), {.force = force}};
  return Innovations(data, given, policy).measured();
}

TEST(Structure, SeesTheSameInARigThatIsTenTimesAsLarge) {
  blind::Rig rig{.plant = cart(), .disturbance_n = 0.05};
  rig.unknown = blind::Unknown::encoder_play;
  rig.play_m = 3e-4;
  const std::vector<Measurement> runs = runs_of(rig);
  const InnovationStatistics small = left_of(runs, cart(), 0.1, policy_for(cart()));
  const InnovationStatistics large = left_of(enlarged(runs), large_cart(), 100.0, policy_for(large_cart()));
  EXPECT_EQ(large.named_probe, small.named_probe);
  EXPECT_NEAR(large.largest_dependence(), small.largest_dependence(), 1e-3 * small.largest_dependence());
  EXPECT_NEAR(large.dispersion, small.dispersion, 1e-3 * small.dispersion);
}

TEST(PlantScale, IsOneForSmallCarts) {
  const PlantScale small = scale_of(cart());
  for (const double one : {small.length, small.speed, small.rate, small.voltage, small.force, small.torque})
    EXPECT_EQ(one, 1.0);
  const PlantScale large = scale_of(large_cart());
  EXPECT_EQ(large.length, 10.0);
  EXPECT_EQ(large.speed, 10.0);
  EXPECT_EQ(large.voltage, 10.0);
  EXPECT_EQ(large.force, 1000.0);
}

TEST(PlantScale, IsOneWhereAPlantHasNoneOfItsOwn) {
  Plant plant = cart();
  plant.gravity_mps2 = 0.0;
  plant.motor = {1.7, 0.0};
  plant.effects.clear();
  const PlantScale scale = scale_of(plant);
  for (const double one : {scale.length, scale.speed, scale.voltage, scale.force}) EXPECT_EQ(one, 1.0);
}

/// A cart that a white force pushes, examined at the plant and the noise that made it.
Innovations of_white_force(const std::vector<Measurement>& runs, const blind::Rig& rig) {
  const FitData data{&runs, cut_segments(runs)};
  const FitPoint start{rig.plant, estimate_initial_states(runs, data.segments, rig.plant), {.force = 0.1}};
  return {data, fit(data, start, {}).point, {}};
}

ResidualTests tests_of(const Innovations& innovations) {
  ResidualTests tests;
  tests.noise_ratio = 10.0;
  tests.statistics = innovations.measured();
  tests.p_values = residual_p_values(innovations, tests.statistics, {});
  return tests;
}

/// How many draws are at least as large as another draw of the same model.
double share_as_large(const std::vector<double>& draws, double value) {
  return static_cast<double>(
             std::count_if(draws.begin(), draws.end(), [&](double d) { return d >= value; })) /
         static_cast<double>(draws.size());
}

TEST(Bootstrap, DrawsWhatTheModelWouldShow) {
  const blind::Rig rig{.plant = cart(), .disturbance_n = 0.05};
  const std::vector<Measurement> runs = runs_of(rig);
  const Innovations innovations = of_white_force(runs, rig);
  double power = 0.0, dispersion = 0.0;
  constexpr int count = 200;
  for (int i = 1; i <= count; ++i) {
    const InnovationStatistics s = innovations.drawn(static_cast<std::uint64_t>(i));
    power += s.pulse_size[0] / count;
    dispersion += s.dispersion / count;
    EXPECT_EQ(s.dispersion, innovations.drawn(static_cast<std::uint64_t>(i)).dispersion);
  }
  EXPECT_NEAR(power, 1.0, 0.05) << "a pulse of white noise has its standard error";
  EXPECT_GT(dispersion, 1.0);
  EXPECT_LT(dispersion, 1.3);
}

TEST(Bootstrap, FindsBacklashAndNotWhiteForce) {
  blind::Rig rig{.plant = cart(), .disturbance_n = 0.05};
  const auto fails = [&] {
    const std::vector<Measurement> runs = runs_of(rig);
    return failed_test(tests_of(of_white_force(runs, rig)), {}) != nullptr;
  };
  EXPECT_FALSE(fails());
  rig.unknown = blind::Unknown::encoder_play;
  rig.play_m = 5e-4;
  EXPECT_TRUE(fails());
}

/// Statistics beside a Gauss-Markov force of this size, as the fit of a disturbance has it.
ResidualTests beside_coloured_force(const blind::Rig& rig, double force_n, double correlation_s,
                                    blind::Experiment experiment = blind::Experiment::square) {
  const std::vector<Measurement> runs = runs_of(rig, experiment);
  const FitData data{&runs, cut_segments(runs)};
  FitPoint point{rig.plant, estimate_initial_states(runs, data.segments, rig.plant), {.force = 0.01}};
  point.noise.coloured_force_n = force_n;
  point.noise.correlation_s = correlation_s;
  return tests_of({data, with_fitted_initial_states(data, point), {}});
}

TEST(Bootstrap, FindsGustsThatASlowForceAccountsFor) {
  constexpr double force_n = 0.2, correlation_s = 0.15;
  blind::Rig rig{.plant = cart(), .coloured = {.force_n = force_n, .force_time_s = correlation_s}};
  const ResidualTests gaussian = beside_coloured_force(rig, force_n, correlation_s);
  EXPECT_EQ(failed_test(gaussian, {}), nullptr);
  EXPECT_NEAR(gaussian.statistics.disturbance_kurtosis[0], 3.0, 1.0);
  rig.coloured = {};
  rig.disturbance_n = 0.02;
  rig.unknown = blind::Unknown::gusts;
  rig.gust_force_n = 1.0;
  const ResidualTests gusts = beside_coloured_force(rig, force_n, correlation_s);
  EXPECT_GT(gusts.statistics.disturbance_kurtosis[0], 2.0 * AdequacyPolicy{}.min_kurtosis);
  EXPECT_NE(failed_test(gusts, {}), nullptr);
}

// Where dry friction holds and lets go, a filter of the right model is far off for a moment.
TEST(Bootstrap, TakesStickingForNoBursts) {
  constexpr double force_n = 0.3, correlation_s = 0.15;
  constexpr AdequacyPolicy policy;
  blind::Rig rig{.plant = cart(), .coloured = {.force_n = force_n, .force_time_s = correlation_s}};
  for (const blind::Experiment experiment : {blind::Experiment::multisine, blind::Experiment::coast})
    for (const double level_n : {1.0, 1.5}) {
      rig.plant.set("coulomb_friction", {level_n});
      const InnovationStatistics sticking =
          beside_coloured_force(rig, force_n, correlation_s, experiment).statistics;
      EXPECT_LT(sticking.dispersion, policy.min_dispersion) << level_n;
      EXPECT_LT(sticking.kurtosis[0], policy.min_kurtosis) << level_n;
      EXPECT_LT(sticking.disturbance_kurtosis[0], policy.min_kurtosis) << level_n;
    }
}

TEST(Bootstrap, EndsEarlyWhereChanceIsPlain) {
  const blind::Rig rig{.plant = cart(), .disturbance_n = 0.05};
  const std::vector<Measurement> runs = runs_of(rig);
  const Innovations innovations = of_white_force(runs, rig);
  const InnovationStatistics usual = innovations.drawn(12345);
  EXPECT_TRUE(residual_p_values(innovations, usual, {}).empty()) << "nothing is beyond a limit";
  SelectionPolicy strict;
  strict.adequacy.min_kurtosis = 0.0;
  const std::vector<double> p_values = residual_p_values(innovations, usual, strict);
  ASSERT_EQ(p_values.size(), residual_test_table().size());
  std::vector<double> kurtosis;
  for (std::uint64_t seed = 1; seed <= strict.residual.draws; ++seed)
    kurtosis.push_back(innovations.drawn(seed).kurtosis[0]);
  EXPECT_NEAR(p_values[2], share_as_large(kurtosis, usual.kurtosis[0]), 0.15) << "of fewer draws";
}

}  // namespace
}  // namespace upright
