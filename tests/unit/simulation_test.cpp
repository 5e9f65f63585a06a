// Simulation of records: against motions that are known in closed form.
#include "estimation/simulation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "plants.hpp"
#include "upright/base/error.hpp"

namespace upright {
namespace {

constexpr double force_per_volt_n = 2.0, mass_kg = 0.5, damping_n_per_mps = 3.0;

Plant damped_cart() {
  Plant plant;
  plant.cart_mass_kg = mass_kg;
  plant.motor = {force_per_volt_n, 0.0};
  plant.set("viscous_friction", {damping_n_per_mps});
  return plant;
}

Plant frictionless_cart() {
  Plant plant = damped_cart();
  plant.effects.clear();
  return plant;
}

/// The voltage of the row at `time_s`: steps of both signs.
double square_wave_v(double time_s) {
  return std::sin(5.0 * time_s) > 0.0 ? 1.5 : -1.0;
}

/// Rows at the given times of a damped cart under the square wave, by the exact solution between two rows.
Measurement damped_motion(const std::vector<double>& times, double cart_m, double cart_mps) {
  Measurement run;
  run.name = "run";
  const double rate = damping_n_per_mps / mass_kg;
  for (std::size_t k = 0; k < times.size(); ++k) {
    run.time_s.push_back(times[k]);
    run.voltage_v.push_back(square_wave_v(times[k]));
    run.cart_m.push_back(cart_m);
    if (k + 1 == times.size()) break;
    const double h = times[k + 1] - times[k];
    const double final_mps = force_per_volt_n * run.voltage_v.back() / damping_n_per_mps;
    cart_m += final_mps * h + (cart_mps - final_mps) * (1.0 - std::exp(-rate * h)) / rate;
    cart_mps = final_mps + (cart_mps - final_mps) * std::exp(-rate * h);
  }
  return run;
}

std::vector<double> even_times(double rate_hz, double duration_s) {
  std::vector<double> times;
  for (int k = 0; k <= static_cast<int>(duration_s * rate_hz); ++k) times.push_back(k / rate_hz);
  return times;
}

RunSimulation simulated(const Plant& plant, const Measurement& run, const SimulationOptions& options = {}) {
  return simulate_runs(plant, {run}, options).front();
}

TEST(Simulation, FollowsTheExactMotionOfADampedCart) {
  const Measurement run = damped_motion(even_times(500.0, 10.0), 0.1, -0.3);
  const RunSimulation simulation = simulated(damped_cart(), run);
  EXPECT_EQ(simulation.samples, run.size());
  EXPECT_EQ(simulation.pieces.size(), 1u);
  EXPECT_LT(simulation.cart_error_m.rmse, 1e-8);
  EXPECT_TRUE(std::isnan(simulation.theta_error_rad.rmse)) << "there is no pendulum";
}

TEST(Simulation, HoldsTheInputUntilTheNextRow) {
  std::vector<double> times;
  for (double t = 0.0; times.size() < 3000; t += times.size() % 3 == 0 ? 0.004 : 0.0013) times.push_back(t);
  const RunSimulation simulation = simulated(damped_cart(), damped_motion(times, 0.0, 0.2));
  EXPECT_LT(simulation.cart_error_m.rmse, 1e-7);
}

TEST(Simulation, LeavesTheErrorThatAMissingForceCauses) {
  // The measured cart accelerates, the simulated one does not: what remains is the parabola less the line
  // that fits its first samples.
  constexpr double acceleration_mps2 = 0.4;
  Measurement run;
  run.name = "run";
  run.time_s = even_times(200.0, 4.0);
  run.voltage_v.assign(run.size(), 0.0);
  for (const double t : run.time_s) run.cart_m.push_back(0.5 * acceleration_mps2 * t * t);
  for (const std::size_t samples : {std::size_t{20}, std::size_t{80}}) {
    const auto n = static_cast<Eigen::Index>(samples);
    Eigen::MatrixX2d line(n, 2);
    for (Eigen::Index i = 0; i < n; ++i) line.row(i) << 1.0, run.time_s[static_cast<std::size_t>(i)];
    const Eigen::Vector2d fitted =
        line.householderQr().solve(Eigen::Map<const Eigen::VectorXd>(run.cart_m.data(), n));
    double squares = 0.0;
    for (std::size_t k = 0; k < run.size(); ++k)
      squares += std::pow(run.cart_m[k] - fitted[0] - fitted[1] * run.time_s[k], 2);
    const double expected_m = std::sqrt(squares / static_cast<double>(run.size()));
    const RunSimulation simulation = simulated(frictionless_cart(), run, {{}, {}, samples});
    EXPECT_NEAR(simulation.cart_error_m.rmse, expected_m, 1e-4 * expected_m) << samples;
    EXPECT_DOUBLE_EQ(simulation.cart_error_m.largest_at_s, run.time_s.back());
  }
}

TEST(Simulation, OfPiecesBeginsEachAnew) {
  Measurement run = damped_motion(even_times(500.0, 10.0), 0.0, 0.0);
  for (std::size_t k = 0; k < run.size(); ++k) run.cart_m[k] += 0.002 * run.time_s[k] * run.time_s[k];
  const RunSimulation whole = simulated(damped_cart(), run),
                      pieces = simulated(damped_cart(), run, {{}, 2.0});
  ASSERT_EQ(pieces.pieces.size(), 5u);
  for (std::size_t p = 0; p < 5; ++p) EXPECT_EQ(pieces.pieces[p].first, 1000 * p);
  EXPECT_EQ(pieces.pieces.back().last, 4999u) << "a rest of one sample is no piece";
  EXPECT_EQ(pieces.samples, 5000u);
  EXPECT_LT(pieces.cart_error_m.rmse, 0.3 * whole.cart_error_m.rmse);
  EXPECT_TRUE(std::isnan(pieces.cart_m[5000]));
}

TEST(Simulation, BeginsWhereItIsAsked) {
  const Measurement run = damped_motion(even_times(500.0, 4.0), 0.0, 0.0);
  const RunSimulation simulation = simulated(damped_cart(), run, {1.5, {}});
  EXPECT_EQ(simulation.samples, run.size() - 750);
  EXPECT_EQ(simulation.pieces.front().first, 750u);
  EXPECT_LT(simulation.cart_error_m.rmse, 1e-8);
}

TEST(Simulation, BeginsAnewBehindAGap) {
  Measurement run = damped_motion(even_times(500.0, 6.0), 0.0, 0.0);
  // What was commanded in the gap moved the cart to where no simulation can follow.
  const auto drop = [&](std::vector<double>& values) {
    values.erase(values.begin() + 1000, values.begin() + 1400);
  };
  drop(run.time_s);
  drop(run.voltage_v);
  drop(run.cart_m);
  for (std::size_t k = 1000; k < run.size(); ++k) run.cart_m[k] += 0.3;
  const RunSimulation at_once = simulated(damped_cart(), run);
  ASSERT_EQ(at_once.pieces.size(), 2u);
  EXPECT_EQ(at_once.samples, run.size());
  EXPECT_LT(at_once.cart_error_m.rmse, 1e-8);
  // Through a delay the commands of the gap act behind it.
  Plant late = damped_cart();
  late.set("input_delay", {0.05});
  const RunSimulation later = simulated(late, run);
  ASSERT_EQ(later.pieces.size(), 2u);
  EXPECT_NEAR(run.time_s[later.pieces[1].first], run.time_s[1000] + 0.05, 0.0021);
}

TEST(Simulation, KnowsTheCommandsFromBeforeThroughADelay) {
  constexpr std::size_t delay_rows = 30;
  Measurement run = damped_motion(even_times(500.0, 4.0), 0.0, 0.0);
  // The same motion under voltages that were commanded earlier.
  std::vector<double> earlier;
  for (std::size_t k = 0; k < run.size(); ++k)
    earlier.push_back(run.voltage_v[std::min(k + delay_rows, run.size() - 1)]);
  run.voltage_v = earlier;
  Plant late = damped_cart();
  late.set("input_delay", {delay_rows / 500.0});
  EXPECT_LT(simulated(late, run, {1.0, {}}).cart_error_m.rmse, 1e-7);
}

/// Rows of a pendulum on a clamped cart, from rest at `amplitude_rad` from hanging, by elliptic integrals:
/// sin(phi / 2) = k sin(psi) and w t = K(k) - F(psi, k). The rows are even in psi, so not quite in time.
Measurement large_swing(double natural_radps, double amplitude_rad) {
  Measurement run;
  run.name = "swing";
  run.cart_locked = true;
  const double modulus = std::sin(0.5 * amplitude_rad);
  constexpr double step_rad = 2e-3, quarter_rad = 0.5 * std::numbers::pi;
  for (int k = 0; k < 10000; ++k) {
    const double psi = quarter_rad - step_rad * k;
    run.time_s.push_back((std::comp_ellint_1(modulus) - std::ellint_1(modulus, psi)) / natural_radps);
    run.voltage_v.push_back(0.0);
    run.theta_rad.push_back(std::numbers::pi + 2.0 * std::asin(modulus * std::sin(psi)));
  }
  return run;
}

TEST(Simulation, OfAClampedCartSwingsAsEllipticIntegralsSay) {
  const Plant plant = test::paper_plant();
  const Pendulum& rod = *plant.pendulum;
  const double natural_radps =
      std::sqrt(rod.mass_kg * plant.gravity_mps2 * rod.length_to_com_m / rod.inertia_about_pivot_kgm2());
  const RunSimulation simulation = simulated(plant, large_swing(natural_radps, 2.0));
  EXPECT_LT(simulation.theta_error_rad.rmse, 1e-6);
  EXPECT_TRUE(simulation.cart_m.empty());
  EXPECT_TRUE(std::isnan(simulation.cart_error_m.rmse));
}

TEST(Simulation, RefusesForcesWithoutLimit) {
  const Measurement run = damped_motion(even_times(500.0, 1.0), 0.0, 0.1);
  Plant plant = damped_cart();
  plant.set("cable_spring", {1e308, -1.0});
  EXPECT_THROW(simulated(plant, run), ConfigError);
}

TEST(Simulation, RefusesWhatCannotBeCompared) {
  Measurement swing = damped_motion(even_times(500.0, 1.0), 0.0, 0.0);
  swing.theta_rad = swing.cart_m;
  swing.cart_m.clear();
  EXPECT_THROW(simulated(damped_cart(), swing), ConfigError) << "an angle, and no pendulum";
  const Measurement run = damped_motion(even_times(500.0, 1.0), 0.0, 0.0);
  EXPECT_THROW(simulated(damped_cart(), run, {{}, 0.01}), ConfigError) << "pieces of 5 samples";
  EXPECT_THROW(simulated(damped_cart(), run, {5.0, {}}), ConfigError) << "after the end";
}

}  // namespace
}  // namespace upright
