// What is left of runs of a rig that the model is not, in words.
#include <gtest/gtest.h>

#include "blind_case.hpp"
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

std::string what_is_left_of(const blind::Rig& rig) {
  std::vector<Measurement> runs;
  for (unsigned seed = 1; seed <= 2; ++seed) {
    blind::Plan plan;
    plan.experiment = blind::Experiment::square;
    plan.rate_hz = 250.0;
    plan.seed = seed;
    runs.push_back(measure(rig, plan, "run"));
  }
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
