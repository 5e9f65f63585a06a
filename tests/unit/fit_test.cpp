// The filter by which segments are followed, on data of the CVODE reference (tests/blind).
#include "estimation/fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "blind_case.hpp"

namespace upright {
namespace {

Plant cart_alone() {
  Plant plant;
  plant.cart_mass_kg = 1.0;
  plant.motor = {1.5, 6.6};
  plant.set("viscous_friction", {2.8});
  return plant;
}

/// A run of each, of this length and with this amplitude of the voltage.
std::vector<Measurement> square_and_multisine(const blind::Rig& rig, double rate_hz, double duration_s,
                                              double amplitude_v) {
  std::vector<Measurement> runs;
  for (const blind::Experiment experiment : {blind::Experiment::square, blind::Experiment::multisine}) {
    blind::Plan plan;
    plan.experiment = experiment;
    plan.rate_hz = rate_hz;
    plan.duration_s = duration_s;
    plan.amplitude_v = amplitude_v;
    runs.push_back(measure(rig, plan, "run"));
  }
  return runs;
}

TEST(Fit, TakesSlidingWhereTheModelRestsForAForce) {
  Plant believed = cart_alone();
  believed.set("coulomb_friction", {0.41});
  blind::Rig rig{.plant = believed};
  rig.plant.set("constant_force", {0.55});
  const std::vector<Measurement> runs = square_and_multisine(rig, 250.0, 8.0, 0.5);
  const FitData data{&runs, cut_segments(runs)};
  const FitPoint start{believed, estimate_initial_states(runs, data.segments, believed), {.force = 0.1}};
  const Noise noise = fit(data, start, {}).point.noise;
  EXPECT_LT(noise.sensors, 1.5);
  EXPECT_GT(noise.force, 0.01);
  EXPECT_LT(noise.force, 1.0);
}

// A trial point may lack what holds the speed, for example with a counter that stays at its fastest rate. The
// speed grew to 460 m/s on a record of a ball screw, and one trial took a minute.
TEST(Fit, HasNoObjectiveWhereTheFilterLosesThePlant) {
  Plant plant = cart_alone();
  plant.set("cogging_force", {0.1, 5e-4, 0.0});
  const std::vector<Measurement> runs = square_and_multisine({.plant = plant}, 250.0, 4.0, 3.0);
  const FitData data{&runs, cut_segments(runs)};
  FitPoint start{plant, estimate_initial_states(runs, data.segments, plant), {.force = 0.1}};
  const auto objective_with = [&](double cart_mps) {
    for (PlantState<double>& state : start.starts) state.cart_mps = cart_mps;
    return fit(data, start, {}, steps_with_fixed_noise(0)).objective;
  };
  EXPECT_TRUE(std::isfinite(objective_with(3.0)));
  EXPECT_EQ(objective_with(100.0), std::numeric_limits<double>::infinity());
}

// A prediction linearises where the fit of a candidate begins.
TEST(Fit, ContinuesFromKnownEquationsAsFromThePoint) {
  Plant plant = cart_alone();
  plant.set("coulomb_friction", {0.3});
  const blind::Rig rig{.plant = plant};
  const std::vector<Measurement> runs = square_and_multisine(rig, 250.0, 4.0, 3.0);
  const FitData data{&runs, cut_segments(runs)};
  plant.set("coulomb_friction", {0.1});
  FreeParameter friction;
  friction.effect = effect_number("coulomb_friction");
  friction.high = 3.0;
  const FitPoint start{plant, estimate_initial_states(runs, data.segments, plant), {.force = 0.1}};
  FitOptions linearise_only = steps_with_fixed_noise(0);
  linearise_only.keep_equations = true;
  const FitResult linearised = fit(data, start, {friction}, linearise_only);
  FitOptions options = steps_with_fixed_noise(3);
  options.noise_at_end_below = std::numeric_limits<double>::infinity();
  const FitResult once = fit(data, start, {friction}, options);
  const FitResult continued = continue_fit(data, linearised, {friction}, options);
  EXPECT_EQ(continued.point.plant.find(friction.effect)->values,
            once.point.plant.find(friction.effect)->values);
  EXPECT_EQ(continued.point.noise.force, once.point.noise.force);
  EXPECT_EQ(continued.objective, once.objective);
  EXPECT_LT(continued.work_samples, once.work_samples);
  // The noise needs the steps too, where no step of the descent supplies them.
  options.max_iterations = 0;
  EXPECT_EQ(continue_fit(data, linearised, {friction}, options).objective,
            fit(data, start, {friction}, options).objective);
}

/// Fits the first parameters of an effect from a guess, to runs of a cart that has it.
void expect_found(std::size_t effect, const std::vector<double>& truth, const std::vector<double>& guess,
                  std::size_t free_count) {
  Plant plant = cart_alone();
  plant.set("coulomb_friction", {0.3});
  plant.set(effect, truth);
  const blind::Rig rig{.plant = plant};
  const std::vector<Measurement> runs = square_and_multisine(rig, 500.0, 6.0, 3.0);
  plant.set(effect, guess);
  const FitData data{&runs, cut_segments(runs)};
  std::vector<FreeParameter> free(free_count);
  for (std::size_t i = 0; i < free.size(); ++i) {
    free[i].effect = effect;
    free[i].index = i;
    free[i].low = 1e-2 * truth[i];
    free[i].high = 1e2 * truth[i];
    free[i].scale = 0.3 * truth[i];
  }
  const FitPoint start{plant, estimate_initial_states(runs, data.segments, plant), {.force = 0.1}};
  const FitResult found = fit(data, start, free);
  EXPECT_LT(whitened_rms(found), 1.2);
  for (std::size_t i = 0; i < free.size(); ++i) {
    const double value = found.point.plant.find(effect)->values[i];
    const auto at = static_cast<Eigen::Index>(i);
    EXPECT_NEAR(value, truth[i], 4.0 * std::sqrt(found.covariance(at, at))) << i;
    EXPECT_NEAR(value, truth[i], 0.1 * truth[i]) << i;
  }
}

TEST(Fit, FindsASprungMassFromAGuess) {
  expect_found(effect_index<effects::SprungMass>(), {0.15, 5.0, 0.08}, {0.1, 5.6, 0.04}, 3);
}

TEST(Fit, FindsBacklashFromAGuess) {
  expect_found(effect_index<effects::Backlash>(), {5e-4, 0.25, 2e4, 10.0}, {3e-4, 0.2, 2e4, 10.0}, 2);
}

TEST(Fit, BeginsAfterAGapOnceTheMotorsLagHasForgottenIt) {
  Plant plant = cart_alone();
  plant.set("motor_lag", {0.036});
  const blind::Rig rig{.plant = plant};
  for (const double gap_s : {0.05, 0.15, 0.4}) {
    blind::Plan plan;
    plan.experiment = blind::Experiment::multisine;
    plan.rate_hz = 500.0;
    plan.duration_s = 4.0;
    plan.amplitude_v = 4.0;
    plan.gaps_s = {{0.7, gap_s}, {1.9, gap_s}, {2.9, gap_s}};
    const std::vector<Measurement> runs = {measure(rig, plan, "run")};
    const FitData data{&runs, cut_segments(runs)};
    ASSERT_EQ(data.segments.size(), 4u);
    const FitResult followed =
        fit_initial_states(data, {plant, estimate_initial_states(runs, data.segments, plant), {}});
    EXPECT_LT(whitened_rms(followed), 1.1) << gap_s;
  }
}

// From the position that is shown: an encoder that errs once per turn is up to 1.2 mm off.
TEST(Fit, FollowsACartWhoseEncoderErrsOncePerTurn) {
  Plant plant = cart_alone();
  plant.set("encoder_eccentricity", {0.2, 0.02, 0.7});
  for (const double compliance_m_per_n : {0.0, 2e-4}) {
    if (compliance_m_per_n > 0.0) plant.set("drive_compliance", {compliance_m_per_n});
    const blind::Rig rig{.plant = plant};
    blind::Plan plan;
    plan.rate_hz = 500.0;
    plan.duration_s = 4.0;
    plan.amplitude_v = 3.0;
    const std::vector<Measurement> runs = {measure(rig, plan, "run")};
    const FitData data{&runs, cut_segments(runs)};
    const FitResult followed =
        fit_initial_states(data, {plant, estimate_initial_states(runs, data.segments, plant), {}});
    EXPECT_LT(whitened_rms(followed), 1.1) << compliance_m_per_n;
  }
}

TEST(Fit, FailsWithMoreParametersThanItCanFree) {
  Plant plant = cart_alone();
  blind::Plan plan;
  plan.duration_s = 1.0;
  const std::vector<Measurement> runs = {measure({.plant = plant}, plan, "run")};
  const FitData data{&runs, cut_segments(runs)};
  std::vector<FreeParameter> free;
  for (std::size_t effect = 0; free.size() <= max_free_parameters(cart_alone()); ++effect) {
    const EffectInfo& info = effect_registry()[effect];
    if (info.enters != Enters::cart || plant.find(effect) != nullptr) continue;
    if (effect == effect_index<effects::SprungMass>()) continue;  // its states leave less room
    std::vector<double> values;
    for (std::size_t i = 0; i < info.parameters.size(); ++i) {
      values.push_back(info.parameters[i].typical);
      free.push_back({.effect = effect, .index = i});
    }
    plant.set(effect, values);
  }
  const FitPoint start{plant, estimate_initial_states(runs, data.segments, plant), {.force = 0.1}};
  FitOptions quick;
  quick.max_iterations = 1;
  const FitResult of_too_many = fit(data, start, free, quick);
  EXPECT_TRUE(std::isinf(of_too_many.objective));
  EXPECT_EQ(of_too_many.covariance.rows(), static_cast<Eigen::Index>(free.size()));
  free.resize(max_free_parameters(cart_alone()));
  EXPECT_TRUE(std::isfinite(fit(data, start, free, quick).objective));
  FitPoint with_two_states = start;
  with_two_states.plant.set("sprung_mass", {0.1, 5.0, 0.05});
  EXPECT_TRUE(std::isinf(fit(data, with_two_states, free, quick).objective));
  free.resize(max_free_parameters(cart_alone()) - 2);
  EXPECT_TRUE(std::isfinite(fit(data, with_two_states, free, quick).objective));
}

TEST(Fit, FindsTheMostLikelyNoise) {
  Plant plant = cart_alone();
  plant.set("coulomb_friction", {0.3});
  for (const std::uint64_t seed : {1, 2, 3}) {
    blind::Rig rig{.plant = plant, .disturbance_n = 0.03, .jitter_s = 3e-4};
    blind::Plan plan;
    plan.experiment = blind::Experiment::multisine;
    plan.seed = seed;
    const std::vector<Measurement> runs = {measure(rig, plan, "run")};
    const FitData data{&runs, cut_segments(runs)};
    const FitResult found =
        fit(data, {plant, estimate_initial_states(runs, data.segments, plant), {.force = 0.1}}, {});
    FitOptions noise_held;
    noise_held.noise_rounds = 0;
    for (double Noise::*number : {&Noise::force, &Noise::sensors, &Noise::jitter_s})
      for (const double factor : {0.8, 1.25}) {
        FitPoint beside = found.point;
        beside.noise.*number *= factor;
        beside.noise.sensors = std::max(beside.noise.sensors, 1.0);
        EXPECT_GT(fit(data, beside, {}, noise_held).objective, found.objective - 1.0) << seed;
      }
    EXPECT_NEAR(found.point.noise.jitter_s, rig.jitter_s, 0.25 * rig.jitter_s) << seed;
  }
}

// The initial speed of a cart at rest is near zero, where it has next to no derivative.
TEST(Fit, ConvergesFromFarAwayWhereTheCartRests) {
  Plant plant = cart_alone();
  plant.set("coulomb_friction", {1.0});
  const std::size_t coulomb = effect_number("coulomb_friction");
  const std::vector<FreeParameter> free = {{.effect = coulomb, .high = 10.0}};
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const blind::Rig rig{.plant = plant, .disturbance_n = 0.03, .cart_step_m = 0.0, .cart_noise_m = 1e-4};
    std::vector<Measurement> runs;
    for (const blind::Experiment experiment : {blind::Experiment::coast, blind::Experiment::multisine}) {
      blind::Plan plan;
      plan.experiment = experiment;
      plan.rate_hz = 125.0;
      plan.duration_s = experiment == blind::Experiment::coast ? 24.0 : 6.0;
      plan.seed = seed;
      runs.push_back(measure(rig, plan, "run"));
    }
    const FitData data{&runs, cut_segments(runs)};
    std::vector<PlantState<double>> starts = estimate_initial_states(runs, data.segments, plant);
    for (std::size_t s = 0; s < starts.size(); ++s)
      if (data.segments[s].run == 0 && s > 1) starts[s].cart_mps = s % 2 == 0 ? 2e-5 : -2e-5;
    std::vector<double> found;
    for (const double force_n : {1.0, 0.2, 2.0}) {
      Plant wrong = plant;
      wrong.set("coulomb_friction", {force_n});
      const FitResult fitted = fit(data, {wrong, starts, {.force = 0.1}}, free);
      found.push_back(fitted.objective);
      EXPECT_NEAR(fitted.point.plant.find(coulomb)->values[0], 1.0, 0.05) << seed << " from " << force_n;
    }
    EXPECT_LT(*std::max_element(found.begin(), found.end()), found[0] + 2.0) << seed;
  }
}

// Such bristles would explain the first milliseconds of any motion.
TEST(Fit, BendsBristlesNoFurtherThanFrictionHoldsThem) {
  constexpr double stiffness_n_per_m = 4000.0, friction_n = 3.0, rate_hz = 200.0;
  Plant plant = cart_alone();
  plant.set("coulomb_friction", {friction_n});
  plant.set("bristle_friction", {stiffness_n_per_m, 50.0});
  for (const double kink_mps : {-0.2, -0.05, 0.05, 0.2}) {
    Measurement run;
    run.name = "run";
    run.cart_resolution_m = 1e-6;
    for (int k = 0; k < 20; ++k) {
      const double time_s = k / rate_hz;
      run.time_s.push_back(time_s);
      run.voltage_v.push_back(0.0);
      run.cart_m.push_back(0.2 * time_s + kink_mps * std::max(time_s - 0.02, 0.0));
    }
    const std::vector<Measurement> runs = {run};
    const FitData data{&runs, {{0, 0, run.size() - 1}}};
    const FitPoint guess{plant, estimate_initial_states(runs, data.segments, plant), {}};
    const PlantState<double> start = fit_initial_states(data, guess).point.starts[0];
    EXPECT_LE(std::abs(start.bristle_m), friction_n / stiffness_n_per_m) << kink_mps;
  }
}

// Friction and back-EMF brake alike: only the belief in the plant file tells them apart, and it is next to
// nothing beside what the data say of the sum.
TEST(Fit, FollowsTheBeliefWhereTheDataLeaveItOpen) {
  const Plant truth = cart_alone();
  const std::vector<Measurement> runs =
      square_and_multisine({.plant = truth, .cart_step_m = 2e-6}, 500.0, 20.0, 6.0);
  const FitData data{&runs, cut_segments(runs)};
  const std::size_t friction = effect_number("viscous_friction"), back_emf = effect_number("back_emf");
  Plant guess = truth;
  guess.set("viscous_friction", {0.1});
  guess.set("back_emf", {1.4});
  const std::vector<FreeParameter> free = {
      {.effect = friction, .low = 0.0, .high = 100.0, .scale = 1.0},
      {.effect = back_emf, .low = 0.1, .high = 10.0, .scale = 0.1, .prior_mean = 1.0, .prior_sigma = 0.05}};
  FitOptions few_steps;
  few_steps.max_iterations = 3;
  const FitPoint start{guess, estimate_initial_states(runs, data.segments, guess), {.force = 0.1}};
  const Plant found = fit(data, start, free, few_steps).point.plant;
  EXPECT_NEAR(found.find(back_emf)->values[0], 1.0, 0.005);
  EXPECT_NEAR(found.find(friction)->values[0], truth.find(friction)->values[0], 0.1);
}

}  // namespace
}  // namespace upright
