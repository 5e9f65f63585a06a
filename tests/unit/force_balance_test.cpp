// Direct readings against closed forms: the balance of forces, steady speeds and breakaways of a cart whose
// numbers are known.
#include "identification/force_balance.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "upright/sim/simulator.hpp"

namespace upright {
namespace {

Plant cart(double extra_n) {
  Plant plant;
  plant.cart_mass_kg = 0.9;
  plant.motor = {1.7, 7.5};
  plant.set("viscous_friction", {3.0});
  plant.set("coulomb_friction", {0.5});
  plant.set("constant_force", {0.1});
  if (extra_n > 0.0) plant.set("stribeck_friction", {extra_n, 0.05, 2.0});
  return plant;
}

template <class Voltage>
Measurement run(const Plant& plant, double duration_s, const Voltage& voltage) {
  Simulator<double> simulator(make_model<double>(plant));
  simulator.start({});
  Measurement m;
  m.name = "run";
  constexpr double period_s = 1e-3, step_m = 2.27485e-5;
  for (int k = 0; k * period_s < duration_s; ++k) {
    const double t = k * period_s;
    simulator.advance_to(t);
    m.time_s.push_back(t);
    m.cart_m.push_back(step_m * std::round(simulator.engine().outputs().cart_m / step_m));
    m.voltage_v.push_back(voltage(t));
    simulator.command(t, m.voltage_v.back());
  }
  m.cart_resolution_m = step_m;
  return m;
}

TEST(ForceBalance, FindsTheNumbersOfACart) {
  const auto swing = [](double t) { return 4.0 * std::sin(3.0 * t) + 2.0 * std::sin(9.0 * t); };
  Plant asked = cart(0.0);
  asked.cart_mass_kg = 0.5;  // what is asked for is not used
  const auto balance = balance_forces({run(cart(0.0), 20.0, swing)}, asked);
  ASSERT_TRUE(balance.has_value());
  EXPECT_NEAR(balance->mass_kg, 0.9, 0.02 * 0.9);
  EXPECT_NEAR(balance->damping_n_per_mps, 10.5, 0.02 * 10.5);
  EXPECT_NEAR(balance->coulomb_n, 0.5, 0.04 * 0.5);
  EXPECT_NEAR(balance->constant_n, 0.1, 0.01);
}

TEST(ForceBalance, SteadySpeedsLieOnTheFrictionCurve) {
  for (const double volts : {1.0, -2.0}) {
    const auto points = find_steady_points({run(cart(0.0), 2.0, [&](double) { return volts; })}, cart(0.0));
    ASSERT_FALSE(points.empty());
    const double sign = volts > 0.0 ? 1.0 : -1.0;
    for (const SteadyPoint& p : points) EXPECT_NEAR(p.friction_n, 3.0 * p.cart_mps + 0.5 * sign - 0.1, 0.02);
  }
}

TEST(ForceBalance, ReadsBreakawayFromARampInBothDirections) {
  for (const double sign : {1.0, -1.0}) {
    const Plant plant = cart(0.4);
    const auto found = find_breakaways({run(plant, 8.0, [&](double t) { return sign * 0.1 * t; })}, plant);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found.front().force_n, sign * 0.9 - 0.1, 0.02);
  }
}

TEST(ForceBalance, AJumpOfTheVoltageShowsNoBreakaway) {
  for (const double volts : {0.34, 1.5}) {
    const auto jump = [&](double t) { return t < 1.0 ? 0.0 : volts; };
    EXPECT_TRUE(find_breakaways({run(cart(0.0), 3.0, jump)}, cart(0.0)).empty()) << volts;
  }
}

TEST(ForceBalance, ACartThatIsPushedDuringARampShowsNoBreakaway) {
  const auto pushed = [](double t) { return 0.1 * t + (t > 2.0 ? 0.3 : 0.0); };
  EXPECT_TRUE(find_breakaways({run(cart(0.0), 4.0, pushed)}, cart(0.0)).empty());
}

TEST(ForceBalance, ASpeedThatStillGrowsIsNotSteady) {
  Plant light = cart(0.0);  // a time constant of 1.1 s
  light.motor.back_emf_n_per_mps = 0.3;
  light.set("viscous_friction", {0.5});
  EXPECT_TRUE(find_steady_points({run(light, 1.5, [](double) { return 1.0; })}, light).empty());
}

TEST(ForceBalance, ASpeedThatCoggingChangesIsNotSteady) {
  Plant cogged = cart(0.0);
  cogged.set("cogging_force", {0.4, 0.02, 0.0});
  EXPECT_TRUE(find_steady_points({run(cogged, 3.0, [](double) { return 1.0; })}, cogged).empty());
}

TEST(ForceBalance, SaysNothingOfACartThatRests) {
  EXPECT_FALSE(balance_forces({run(cart(0.0), 3.0, [](double) { return 0.1; })}, cart(0.0)).has_value());
}

}  // namespace
}  // namespace upright
