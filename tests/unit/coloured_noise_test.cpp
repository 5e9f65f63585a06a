// The coloured part of the filter's noise, on data of the CVODE reference with Gauss-Markov disturbances.
#include <gtest/gtest.h>

#include <cmath>

#include "blind_case.hpp"
#include "estimation/fit.hpp"

namespace upright {
namespace {

constexpr double viscous_n_per_mps = 2.8;

Plant cart_with_viscous_friction() {
  Plant plant;
  plant.cart_mass_kg = 1.0;
  plant.motor = {1.5, 6.6};
  plant.set("viscous_friction", {viscous_n_per_mps});
  return plant;
}

std::vector<Measurement> disturbed_run(double duration_s, std::uint64_t seed) {
  blind::Rig rig{.plant = cart_with_viscous_friction()};
  rig.coloured.force_n = 0.2;
  rig.coloured.force_time_s = 0.1;
  blind::Plan plan;
  plan.experiment = blind::Experiment::multisine;
  plan.rate_hz = 250.0;
  plan.duration_s = duration_s;
  plan.seed = seed;
  return {measure(rig, plan, "run")};
}

std::vector<FreeParameter> viscous_friction_free() {
  FreeParameter free;
  free.effect = effect_number("viscous_friction");
  free.high = 100.0;
  return {free};
}

FitResult fitted(const std::vector<Measurement>& runs, bool coloured) {
  const FitData data{&runs, cut_segments(runs)};
  const Plant plant = cart_with_viscous_friction();
  FitOptions options;
  options.coloured_noise = coloured;
  return fit(data, {plant, estimate_initial_states(runs, data.segments, plant), {.force = 0.1}},
             viscous_friction_free(), options);
}

TEST(ColouredNoise, HasTheSizeAndCorrelationTimeOfTheForce) {
  for (const std::uint64_t seed : {1, 2}) {
    const Noise noise = fitted(disturbed_run(30.0, seed), true).point.noise;
    EXPECT_NEAR(noise.coloured_force_n, 0.2, 0.05) << seed;
    EXPECT_NEAR(std::log(noise.correlation_s / 0.1), 0.0, std::log(1.6)) << seed;
  }
}

TEST(ColouredNoise, ExplainsAColouredForceBetterThanWhiteNoise) {
  const std::vector<Measurement> runs = disturbed_run(10.0, 3);
  EXPECT_LT(fitted(runs, true).objective, fitted(runs, false).objective - 100.0);
}

TEST(ColouredNoise, DispersesTheScoresOfAFitWithWhiteNoise) {
  double white = 0.0, coloured = 0.0;
  for (const std::uint64_t seed : {4, 5, 6}) {
    const std::vector<Measurement> runs = disturbed_run(30.0, seed);
    white += fitted(runs, false).dispersion / 3.0;
    coloured += fitted(runs, true).dispersion / 3.0;
  }
  EXPECT_GT(white, 1.5 * coloured);
  EXPECT_LT(coloured, 1.6);
}

TEST(ColouredNoise, IsNothingWhereOnlyTheEncoderRounds) {
  blind::Plan plan;
  plan.experiment = blind::Experiment::multisine;
  plan.rate_hz = 250.0;
  plan.duration_s = 6.0;
  const std::vector<Measurement> runs = {measure({.plant = cart_with_viscous_friction()}, plan, "run")};
  const FitResult result = fitted(runs, true);
  EXPECT_LT(result.point.noise.coloured_force_n, 1e-3);
  EXPECT_LT(whitened_rms(result), 1.05);
}

TEST(ColouredNoise, GivesIntervalsThatHold) {
  int held = 0;
  constexpr int runs = 40;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const FitResult result = fitted(disturbed_run(8.0, 100 + seed), true);
    const double error = result.point.plant.find("viscous_friction")->values[0] - viscous_n_per_mps;
    held += std::abs(error) < 1.96 * std::sqrt(result.covariance(0, 0)) ? 1 : 0;
  }
  // 95 percent of 40 are 38; fewer than 34 come once in 70 times.
  EXPECT_GE(held, 34);
}

}  // namespace
}  // namespace upright
