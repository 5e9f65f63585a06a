// The generator of cases for the diagnosis: what is unmodelled has the stated size and memory, sensors
// without quantisation have the stated noise, and a case follows from its request.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "coloured_noise.hpp"
#include "extra_forces.hpp"
#include "laboratory.hpp"

namespace upright {
namespace {

using blind::Condition;
using blind::Unknown;

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Mean of the products of values that are `lag` apart.
double correlation(const std::vector<double>& values, std::size_t lag) {
  double sum = 0.0;
  for (std::size_t k = lag; k < values.size(); ++k) sum += values[k] * values[k - lag];
  return sum / static_cast<double>(values.size() - lag);
}

TEST(GaussMarkov, HasTheStatedDeviationAndMemory) {
  constexpr double step_s = 1e-3, memory_s = 0.05, deviation = 0.7;
  std::mt19937_64 random(3);
  blind::GaussMarkov process(deviation, blind::kept_over(step_s, memory_s), random);
  std::vector<double> values;
  for (int k = 0; k < 2000000; ++k) {
    values.push_back(process.value());
    process.step(random);
  }
  // 2000 s are 20000 independent values: their deviation is known to half a percent.
  const double variance = deviation * deviation;
  EXPECT_NEAR(mean_of(values), 0.0, 0.03 * deviation);
  EXPECT_NEAR(correlation(values, 0), variance, 0.04 * variance);
  EXPECT_NEAR(correlation(values, 50), variance * std::exp(-1.0), 0.04 * variance);
  EXPECT_NEAR(correlation(values, 100), variance * std::exp(-2.0), 0.04 * variance);
}

TEST(GaussMarkov, StartsInItsSteadyState) {
  double sum = 0.0;
  constexpr int starts = 20000;
  std::mt19937_64 random(5);
  for (int k = 0; k < starts; ++k) sum += std::pow(blind::GaussMarkov(2.0, 0.999, random).value(), 2);
  EXPECT_NEAR(sum / starts, 4.0, 0.2);
}

TEST(RoughTrack, HasUnitVarianceAndItsLength) {
  constexpr double length_m = 0.02;
  double variance = 0.0, at_length = 0.0;
  constexpr int tracks = 20000;
  for (int seed = 0; seed < tracks; ++seed) {
    const blind::RoughTrack track(length_m, static_cast<std::uint64_t>(seed));
    variance += std::pow(track.at(0.1), 2);
    at_length += track.at(0.1) * track.at(0.1 + length_m);
  }
  EXPECT_NEAR(variance / tracks, 1.0, 0.05);
  EXPECT_NEAR(at_length / tracks, std::exp(-0.5), 0.05);
}

TEST(RoughTrack, IsTheSameAtEachPassage) {
  const blind::RoughTrack track(0.02, 7), again(0.02, 7), other(0.02, 8);
  EXPECT_EQ(track.at(0.123), again.at(0.123));
  EXPECT_NE(track.at(0.123), other.at(0.123));
}

/// A cart alone of the size of the paper's.
blind::Rig quiet_rig() {
  blind::Rig rig;
  rig.plant.cart_mass_kg = 0.8;
  rig.plant.motor = {1.7, 7.7};
  return rig;
}

blind::Plan long_plan() {
  blind::Plan plan;
  plan.duration_s = 600.0;
  plan.seed = 11;
  return plan;
}

TEST(ExtraForces, GrowWithSpeedAsStated) {
  blind::Rig rig = quiet_rig();
  rig.coloured = {.force_n = 0.2, .force_time_s = 0.02, .speed_mps = 0.5};
  const blind::Plan plan = long_plan();
  const blind::ExtraForces extra(rig, plan);
  ASSERT_TRUE(extra.varies());
  PlantState<double> rest, fast;
  fast.cart_mps = 1.0;
  std::vector<double> at_rest, at_speed;
  for (double t = 0.0; t < plan.duration_s; t += blind::force_step_s) {
    at_rest.push_back(extra.cart_force_n(t, rest));
    at_speed.push_back(extra.cart_force_n(t, fast));
  }
  EXPECT_NEAR(std::sqrt(correlation(at_rest, 0)), 0.2, 0.01);
  EXPECT_NEAR(correlation(at_rest, 20), 0.04 * std::exp(-1.0), 0.003);
  EXPECT_NEAR(std::sqrt(correlation(at_speed, 0)), 0.2 * std::sqrt(5.0), 0.02);
}

TEST(ExtraForces, TorqueHasItsOwnSizeAndMemory) {
  blind::Rig rig = quiet_rig();
  rig.coloured = {.torque_nm = 0.01, .torque_time_s = 0.03};
  const blind::Plan plan = long_plan();
  const blind::ExtraForces extra(rig, plan);
  ASSERT_TRUE(extra.varies());
  std::vector<double> torque;
  for (double t = 0.0; t < plan.duration_s; t += blind::force_step_s)
    torque.push_back(extra.pivot_torque_nm(t));
  EXPECT_NEAR(std::sqrt(correlation(torque, 0)), 0.01, 5e-4);
  EXPECT_NEAR(correlation(torque, 30), 1e-4 * std::exp(-1.0), 1e-5);
  EXPECT_EQ(extra.cart_force_n(1.0, {}), 0.0);
}

TEST(ExtraForces, UnknownOnesFollowTheState) {
  const blind::Plan plan = long_plan();
  const auto force = [&](Unknown unknown, double time_s, double x, double v) {
    blind::Rig rig = quiet_rig();
    rig.unknown = unknown;
    rig.unknown_size = 0.5;
    rig.unknown_period = 0.2;
    PlantState<double> state;
    state.cart_m = x;
    state.cart_mps = v;
    return blind::ExtraForces(rig, plan).cart_force_n(time_s, state);
  };
  EXPECT_NEAR(force(Unknown::velocity_ripple, 1.0, 0.3, 0.05), 0.5, 1e-12);
  EXPECT_NEAR(force(Unknown::force_drift, 0.0, 0.3, 0.0), -0.5, 1e-12);
  EXPECT_NEAR(force(Unknown::force_drift, 450.0, 0.3, 0.0), 0.25, 1e-12);
  EXPECT_EQ(force(Unknown::rough_track, 1.0, 0.03, 0.0), force(Unknown::rough_track, 99.0, 0.03, 2.0));
}

/// A torque turns a pendulum on a locked cart by its law: J theta'' = T, at first.
TEST(ExtraForces, TorqueTurnsThePendulum) {
  blind::Rig rig = quiet_rig();
  rig.plant.pendulum = Pendulum{0.2, 0.3, {}};
  rig.theta_step_rad = 0.0;
  rig.coloured = {.torque_nm = 0.01, .torque_time_s = 1e6};
  blind::Plan plan;
  plan.experiment = blind::Experiment::locked_swing;
  plan.rate_hz = 1000.0;
  plan.duration_s = 0.0405;
  plan.swing_rad = 0.0;
  const double torque_nm = blind::ExtraForces(rig, plan).pivot_torque_nm(0.0);
  const Measurement run = blind::measure(rig, plan, "run");
  const double expected = 0.5 * torque_nm / rig.plant.pendulum->inertia_about_pivot_kgm2() * 0.04 * 0.04;
  EXPECT_NEAR(run.theta_rad.back() - run.theta_rad.front(), expected, 0.05 * std::abs(expected));
}

TEST(Sensors, WithoutQuantisationHaveTheStatedNoise) {
  blind::Rig rig = quiet_rig();
  rig.plant.pendulum = Pendulum{0.2, 0.3, {}};
  rig.cart_step_m = rig.theta_step_rad = 0.0;
  blind::Plan plan;
  plan.rate_hz = 1000.0;
  plan.duration_s = 20.0;
  plan.seed = 5;
  plan.amplitude_v = 0.0;
  plan.centring_v_per_m = 0.0;
  const Measurement exact = blind::measure(rig, plan, "exact");
  rig.cart_noise_m = 1e-4;
  rig.theta_noise_rad = 2e-3;
  const auto errors = [&](const std::vector<double>& with, const std::vector<double>& without) {
    std::vector<double> result;
    for (std::size_t k = 0; k < with.size(); ++k) result.push_back(with[k] - without[k]);
    return result;
  };
  const Measurement white = blind::measure(rig, plan, "white");
  const std::vector<double> cart = errors(white.cart_m, exact.cart_m);
  const std::vector<double> theta = errors(white.theta_rad, exact.theta_rad);
  EXPECT_NEAR(std::sqrt(correlation(cart, 0)), 1e-4, 2e-6);
  EXPECT_NEAR(std::sqrt(correlation(theta, 0)), 2e-3, 4e-5);
  EXPECT_NEAR(correlation(cart, 1) / correlation(cart, 0), 0.0, 0.03);
  EXPECT_EQ(white.cart_resolution_m, 0.0);
  rig.noise_colour = 0.5;
  rig.noise_time_s = 0.01;
  const std::vector<double> coloured = errors(blind::measure(rig, plan, "coloured").cart_m, exact.cart_m);
  EXPECT_NEAR(correlation(coloured, 0), 1.25e-8, 0.06e-8);
  EXPECT_NEAR(correlation(coloured, 10), 0.25e-8 * std::exp(-1.0), 0.03e-8);
}

TEST(LaboratoryCase, FollowsFromItsRequest) {
  blind::Request request = blind::laboratory_request(21, {"coulomb_friction"});
  request.max_samples = 1500.0;
  const blind::Case one = make_case(request), same = make_case(request);
  request.seed = 22;
  const blind::Case other = make_case(request);
  const auto runs = measure_all(one), again = measure_all(same);
  ASSERT_EQ(runs.size(), again.size());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    EXPECT_EQ(runs[r].time_s, again[r].time_s);
    EXPECT_EQ(runs[r].voltage_v, again[r].voltage_v);
    EXPECT_EQ(runs[r].cart_m, again[r].cart_m);
    EXPECT_EQ(runs[r].theta_rad, again[r].theta_rad);
  }
  EXPECT_NE(one.believed.cart_mass_kg, other.believed.cart_mass_kg);
  EXPECT_EQ(measure_fresh(one).cart_m, measure_fresh(same).cart_m);
  EXPECT_NE(measure_fresh(one).cart_m, runs[0].cart_m);
}

TEST(LaboratoryCase, StaysWithinWhatItStates) {
  std::set<double> rates;
  double lightest_kg = 1e9, heaviest_kg = 0.0;
  std::size_t unquantised = 0, max_runs = 0;
  constexpr std::uint64_t cases = 60;
  for (std::uint64_t seed = 0; seed < cases; ++seed) {
    blind::Request request = blind::laboratory_request(seed);
    request.max_samples = 4000.0;  // two seconds at the highest rate
    const blind::Case one = make_case(request);
    lightest_kg = std::min(lightest_kg, one.believed.cart_mass_kg);
    heaviest_kg = std::max(heaviest_kg, one.believed.cart_mass_kg);
    EXPECT_NEAR(one.rig.plant.cart_mass_kg / one.believed.cart_mass_kg, 1.0, 0.05);
    EXPECT_NEAR(one.rig.plant.motor.back_emf_n_per_mps / one.believed.motor.back_emf_n_per_mps, 1.0, 0.05);
    unquantised += one.rig.cart_step_m == 0.0 ? 1u : 0u;
    EXPECT_EQ(one.rig.cart_step_m == 0.0, one.rig.cart_noise_m > 0.0);
    max_runs = std::max(max_runs, one.plans.size());
    double samples = 0.0;
    for (const blind::Plan& plan : one.plans) {
      rates.insert(plan.rate_hz);
      EXPECT_GE(plan.duration_s, 2.0);
      EXPECT_LE(plan.duration_s, 60.0);
      samples += plan.rate_hz * plan.duration_s;
    }
    EXPECT_LE(samples, one.request.max_samples * (1.0 + 1e-9));
    EXPECT_LE(one.plans.size(), 8u);
  }
  EXPECT_LT(lightest_kg, 1.0);
  EXPECT_GT(heaviest_kg, 30.0);
  EXPECT_GE(lightest_kg, 0.3);
  EXPECT_LE(heaviest_kg, 100.0);
  EXPECT_EQ(*rates.begin(), 100.0);
  EXPECT_EQ(*rates.rbegin(), 2000.0);
  EXPECT_GT(unquantised, cases / 4);
  EXPECT_LT(unquantised, 3 * cases / 4);
  EXPECT_GE(max_runs, 6u);
}

TEST(LaboratoryCase, HidesEveryKind) {
  std::vector<std::string> kinds = blind::hidden_kinds();
  kinds.insert(kinds.end(), {"sprung_mass", "backlash", "flexible_rod", "lost_counts"});
  const std::size_t known_kinds = kinds.size();
  for (const std::string& kind : blind::unknown_kinds(Condition::laboratory)) kinds.push_back(kind);
  std::uint64_t seed = 100;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const std::string& kind = kinds[i];
    blind::Request request = blind::laboratory_request(++seed, {kind});
    request.max_samples = 1000.0;
    const blind::Case one = make_case(request);
    const bool known = i < known_kinds;
    EXPECT_EQ(one.hidden.size(), known ? 1u : 0u) << kind;
    EXPECT_EQ(one.rig.unknown == Unknown::none, known) << kind;
    EXPECT_TRUE(fault_of(one.rig.plant).empty()) << kind << ": " << fault_of(one.rig.plant);
  }
}

}  // namespace
}  // namespace upright
