// What is left of runs of a rig that the model is not, in words.
#include <gtest/gtest.h>

#include "blind_case.hpp"
#include "diagnosis/plant_scale.hpp"
#include "diagnosis/residual_test_table.hpp"

namespace upright {
namespace {

Plant cart() {
  Plant plant;
  plant.cart_mass_kg = 1.0;
  plant.motor = {1.7, 7.7};
  plant.set("viscous_friction", {3.0});
  return plant;
}

std::vector<Measurement> runs_of(const blind::Rig& rig) {
  std::vector<Measurement> runs;
  for (unsigned seed = 1; seed <= 2; ++seed) {
    blind::Plan plan;
    plan.experiment = blind::Experiment::square;
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
  return examine_residuals(data, fit(data, start, {}).point, {}).depends_on;
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
ResidualTests left_of(const std::vector<Measurement>& runs, const Plant& plant, double force,
                      const SelectionPolicy& policy) {
  const FitData data{&runs, cut_segments(runs)};
  const FitPoint given{plant, estimate_initial_states(runs, data.segments, plant), {.force = force}};
  return examine_residuals(data, given, policy);
}

TEST(Structure, SeesTheSameInARigThatIsTenTimesAsLarge) {
  blind::Rig rig{.plant = cart(), .disturbance_n = 0.05};
  rig.unknown = blind::Unknown::backlash;
  rig.backlash_m = 3e-4;
  const std::vector<Measurement> runs = runs_of(rig);
  const ResidualTests small = left_of(runs, cart(), 0.1, policy_for(cart()));
  const ResidualTests large = left_of(enlarged(runs), large_cart(), 100.0, policy_for(large_cart()));
  EXPECT_EQ(large.depends_on, small.depends_on);
  EXPECT_NEAR(large.certainty, small.certainty, 1e-3 * small.certainty);
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

/// Beyond the sensors' noise, by so much that a verdict is due.
bool is_more_than_noise(double kurtosis, double slow_force) {
  ResidualTests left;
  left.noise_ratio = 10.0;
  left.tails = {kurtosis, 2.0};
  left.slow_force = slow_force;
  conclude_tests(left, {});
  return left.structured;
}

TEST(Structure, TakesForcesThatLastAndComeInBurstsForMoreThanNoise) {
  EXPECT_FALSE(is_more_than_noise(3.0, 1.8)) << "a steady disturbance";
  EXPECT_FALSE(is_more_than_noise(7.0, 1.0)) << "a sensor that errs now and then";
  EXPECT_TRUE(is_more_than_noise(6.0, 1.8));
}

}  // namespace
}  // namespace upright
