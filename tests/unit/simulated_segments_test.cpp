// Simulation of measured segments, and the rig that makes blind data: both against each other, since one
// follows the event engine and the other the CVODE reference.
#include "diagnosis/simulated_segments.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "blind_case.hpp"

namespace upright {
namespace {

/// So many times as heavy, with a motor and friction so many times as strong, it moves as the light plant.
Plant rig_plant(double times = 1.0) {
  Plant plant;
  plant.cart_mass_kg = 0.8 * times;
  plant.pendulum = Pendulum{0.2 * times, 0.3, {}};
  plant.motor = {1.7 * times, 7.7 * times};
  plant.set("viscous_friction", {3.0 * times});
  plant.set("coulomb_friction", {0.4 * times});
  plant.set("input_delay", {0.003});
  return plant;
}

blind::Plan short_plan(blind::Experiment experiment) {
  blind::Plan plan;
  plan.experiment = experiment;
  plan.rate_hz = 250.0;
  plan.duration_s = 3.0;
  plan.seed = 7;
  return plan;
}

double rms_of_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

TEST(SimulateSegments, OfTheTruePlantLeavesTheEncodersSteps) {
  const blind::Rig rig{.plant = rig_plant()};
  for (const blind::Experiment experiment : {blind::Experiment::multisine, blind::Experiment::square}) {
    const std::vector<Measurement> runs = {measure(rig, short_plan(experiment), "run")};
    const auto traces = simulate_segments(rig.plant, runs, cut_segments(runs));
    ASSERT_FALSE(traces.empty());
    for (const SimulatedSegment& trace : traces) {
      EXPECT_LT(rms_of_difference(trace.cart_m, trace.simulated_cart_m), 0.5 * rig.cart_step_m);
      EXPECT_LT(rms_of_difference(trace.theta_rad, trace.simulated_theta_rad), 0.5 * rig.theta_step_rad);
    }
  }
}

/// A fit from the estimated start alone ends elsewhere in 13 of the 18 segments of each plant.
TEST(SimulateSegments, FindsTheBasinOfTheStartOnACoggedTrack) {
  for (const double times : {1.0, 100.0}) {
    blind::Rig rig{.plant = rig_plant(times)};
    rig.plant.remove(effect_number("coulomb_friction"));
    rig.plant.set("cogging_force", {1.0 * times, 0.005, -2.3});
    std::vector<Measurement> runs;
    for (unsigned seed = 1; seed <= 6; ++seed) {
      blind::Plan plan = short_plan(blind::Experiment::multisine);
      plan.duration_s = 6.0;
      plan.amplitude_v = 1.0;
      plan.seed = seed;
      runs.push_back(measure(rig, plan, "run"));
    }
    for (const SimulatedSegment& trace : simulate_segments(rig.plant, runs, cut_segments(runs)))
      EXPECT_LT(rms_of_difference(trace.cart_m, trace.simulated_cart_m), rig.cart_step_m);
  }
}

TEST(SimulateSegments, OfAnotherPlantIsOff) {
  const blind::Rig rig{.plant = rig_plant()};
  const std::vector<Measurement> runs = {measure(rig, short_plan(blind::Experiment::square), "run")};
  Plant other = rig.plant;
  other.remove(effect_number("coulomb_friction"));
  double largest = 0.0;
  for (const SimulatedSegment& trace : simulate_segments(other, runs, cut_segments(runs)))
    largest = std::max(largest, rms_of_difference(trace.cart_m, trace.simulated_cart_m));
  EXPECT_GT(largest, 20.0 * rig.cart_step_m);
}

TEST(SimulateSegments, LeavesEmptyWhatIsNotMeasured) {
  const blind::Rig rig{.plant = rig_plant()};
  const std::vector<Measurement> runs = {measure(rig, short_plan(blind::Experiment::locked_swing), "run")};
  for (const SimulatedSegment& trace : simulate_segments(rig.plant, runs, cut_segments(runs))) {
    EXPECT_TRUE(trace.cart_m.empty());
    EXPECT_TRUE(trace.simulated_cart_m.empty());
    EXPECT_EQ(trace.theta_rad.size(), trace.time_s.size());
  }
}

TEST(BlindRun, IsTheSameForTheSameSeed) {
  const blind::Rig rig{.plant = rig_plant(), .disturbance_n = 0.05, .jitter_s = 1e-4};
  const blind::Plan plan = short_plan(blind::Experiment::multisine);
  const Measurement once = measure(rig, plan, "run"), again = measure(rig, plan, "run");
  EXPECT_EQ(once.cart_m, again.cart_m);
  EXPECT_EQ(once.voltage_v, again.voltage_v);
}

TEST(BlindRun, BacklashHidesHalfThePlayEitherWay) {
  blind::Rig rig{.plant = rig_plant()};
  rig.plant.remove(effect_number("coulomb_friction"));
  blind::Plan plan = short_plan(blind::Experiment::multisine);
  plan.centring_v_per_m = 0.0;  // so that what the encoder shows does not come back into the voltages
  const Measurement plain = measure(rig, plan, "run");
  rig.unknown = blind::Unknown::encoder_play;
  rig.play_m = 2e-3;
  const Measurement loose = measure(rig, plan, "run");
  double largest = 0.0;
  for (std::size_t k = 0; k < plain.size(); ++k)
    largest = std::max(largest, std::abs(plain.cart_m[k] - loose.cart_m[k]));
  EXPECT_NEAR(largest, 1e-3, 2.0 * rig.cart_step_m);
}

TEST(BlindCase, HidesTheUnknownAndLeavesItOutInTheTwin) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const blind::Case blind =
        blind::make_case({.hidden = {"gusts"}, .seed = seed, .runs = 1, .max_samples = 1500.0});
    EXPECT_EQ(blind.rig.unknown, blind::Unknown::gusts);
    const auto with = measure_all(blind), without = measure_all(blind, true);
    EXPECT_NE(with[0].cart_m, without[0].cart_m);
  }
  const blind::Case hidden =
      blind::make_case({.hidden = {"cable_spring"}, .seed = 4, .runs = 1, .max_samples = 1500.0});
  EXPECT_EQ(hidden.believed.find("cable_spring"), nullptr);
  EXPECT_NE(hidden.rig.plant.find("cable_spring"), nullptr);
}

}  // namespace
}  // namespace upright
