// Closed-form answers of a mass with a motion of its own on the cart, on both engines: a sprung mass, and the
// motor behind its backlash.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "plants.hpp"
#include "sim/cvode_engine.hpp"
#include "upright/sim/event_engine.hpp"

namespace upright {
namespace {

using test::paper_plant;

template <class Engine>
Engine engine_of(const Plant& plant) {
  return Engine(make_model<double>(plant), EngineOptions{});
}

template <class Engine>
class AttachedMassMotion : public testing::Test {};

using Engines = testing::Types<EventEngine<double>, CvodeEngine>;
TYPED_TEST_SUITE(AttachedMassMotion, Engines);

/// Free swing of an oscillator from rest at 1, after a time [s].
double free_swing(double radps, double damping_ratio, double t) {
  const double decay = damping_ratio * radps, swings = radps * std::sqrt(1.0 - damping_ratio * damping_ratio);
  return std::exp(-decay * t) * (std::cos(swings * t) + decay / swings * std::sin(swings * t));
}

// Two bodies on one spring: their centre of mass stays where it is.
TYPED_TEST(AttachedMassMotion, FreeCartSwingsAgainstItsSprungMass) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.motor.back_emf_n_per_mps = 0.0;
  constexpr double sprung_kg = 0.2, frequency_hz = 4.0, damping_ratio = 0.05, q0_m = 0.01;
  plant.set("sprung_mass", {sprung_kg, frequency_hz, damping_ratio});
  auto e = engine_of<TypeParam>(plant);
  PlantState<double> start{0.1};
  start.attached_m = q0_m;
  e.start(start);
  const double both = 1.0 + sprung_kg / plant.cart_mass_kg, faster = std::sqrt(both);
  const double radps = 2.0 * std::numbers::pi * frequency_hz * faster;
  const double share = sprung_kg / (sprung_kg + plant.cart_mass_kg);
  for (int k = 1; k <= 200; ++k) {
    e.advance(0.005, 0.0);
    const double q_m = q0_m * free_swing(radps, damping_ratio * faster, 0.005 * k);
    ASSERT_NEAR(e.state().attached_m, q_m, 1e-8) << k;
    ASSERT_NEAR(e.state().cart_m, 0.1 + share * (q0_m - q_m), 1e-8) << k;
  }
}

// A cart that friction holds does not move, and its sprung mass swings on.
TYPED_TEST(AttachedMassMotion, SprungMassSwingsOnAStickingCart) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  constexpr double sprung_kg = 0.2, frequency_hz = 4.0, damping_ratio = 0.05;
  const double radps = 2.0 * std::numbers::pi * frequency_hz;
  plant.set("coulomb_friction", {0.4});
  plant.set("sprung_mass", {sprung_kg, frequency_hz, damping_ratio});
  const double holds_m = 0.4 / (sprung_kg * radps * radps);  // at most
  for (const double share : {0.99, 1.01}) {
    auto e = engine_of<TypeParam>(plant);
    PlantState<double> start{0.1};
    start.attached_m = share * holds_m;
    e.start(start);
    e.advance(0.01, 0.0);
    EXPECT_EQ(e.state().cart_m == 0.1, share < 1.0);
    for (int k = 1; k <= 100; ++k) e.advance(0.005, 0.0);
    if (share > 1.0) continue;
    EXPECT_EQ(e.state().cart_m, 0.1);
    EXPECT_NEAR(e.state().attached_m, start.attached_m * free_swing(radps, damping_ratio, 0.51), 1e-8);
  }
}

/// A cart alone whose motor has a share of its mass, half a gap from either flank, and no back-EMF.
Plant cart_with_backlash(double gap_m, double damping_s_per_m) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.motor.back_emf_n_per_mps = 0.0;
  plant.set("backlash", {gap_m, 0.25, 1e5, damping_s_per_m});
  return plant;
}

// Hunt and Crossley (1975): speeds v before and after a contact have the same |v| - ln(1 + c v) / c, where
// v > 0 goes into the flank.
TYPED_TEST(AttachedMassMotion, MotorBouncesOffTheFlankOfItsBacklash) {
  constexpr double gap_m = 1e-3, damping_s_per_m = 4.0, into_mps = 0.2;
  Plant plant = cart_with_backlash(gap_m, damping_s_per_m);
  plant.set("coulomb_friction", {100.0});  // holds the cart
  auto e = engine_of<TypeParam>(plant);
  PlantState<double> start{0.1};
  start.attached_mps = into_mps;
  e.start(start);
  e.advance(0.4 * gap_m / into_mps, 0.0);
  EXPECT_NEAR(e.state().attached_m, 0.4 * gap_m, 1e-9);
  EXPECT_NEAR(e.state().attached_mps, into_mps, 1e-9);
  e.advance(0.01, 0.0);
  EXPECT_EQ(e.state().cart_m, 0.1);
  EXPECT_LT(std::abs(e.state().attached_m), 0.5 * gap_m);
  const auto potential = [](double mps) {
    return mps - std::log(1.0 + damping_s_per_m * mps) / damping_s_per_m;
  };
  EXPECT_LT(e.state().attached_mps, 0.0);
  EXPECT_NEAR(potential(e.state().attached_mps), potential(into_mps), 5e-5 * into_mps);
}

TYPED_TEST(AttachedMassMotion, BacklashKeepsTheMomentumOfMotorAndCart) {
  auto e = engine_of<TypeParam>(cart_with_backlash(1e-3, 4.0));
  const double cart_kg = paper_plant().cart_mass_kg, motor_kg = 0.25 * cart_kg;
  PlantState<double> start{0.1};
  start.cart_mps = 0.05;
  start.attached_mps = 0.3;
  e.start(start);
  const double momentum = cart_kg * 0.05 + motor_kg * 0.3;
  for (int k = 1; k <= 40; ++k) {
    e.advance(0.001, 0.0);
    const PlantState<double> s = e.state();
    ASSERT_NEAR(cart_kg * s.cart_mps + motor_kg * s.attached_mps, momentum, 1e-9) << k;
    ASSERT_NEAR(cart_kg * (s.cart_m - 0.1) + motor_kg * s.attached_m, momentum * 0.001 * k, 1e-9) << k;
  }
}

// The motor pushes against one flank: both accelerate as one mass.
TYPED_TEST(AttachedMassMotion, MotorInItsFlankMovesTheCartAsOneMass) {
  auto e = engine_of<TypeParam>(cart_with_backlash(1e-4, 40.0));
  e.start({});
  e.advance(0.2, 2.0);
  const double before_mps = e.state().cart_mps;
  e.advance(0.2, 2.0);
  const double mps2 = 2.0 * paper_plant().motor.force_per_volt_n / paper_plant().cart_mass_kg;
  EXPECT_NEAR(e.state().cart_mps - before_mps, 0.2 * mps2, 1e-3 * mps2);
  const double depth_m = 0.75 * paper_plant().cart_mass_kg * mps2 / 1e5;
  EXPECT_NEAR(e.state().attached_m, 0.5e-4 + depth_m, 0.02 * depth_m);
}

TEST(PlantWithAttachedMass, HasOneAtMost) {
  Plant plant = paper_plant();
  plant.set("sprung_mass", {0.1, 6.0, 0.05});
  EXPECT_EQ(fault_of(plant), "");
  plant.set("backlash", {2e-4, 0.2, 1e5, 10.0});
  EXPECT_NE(fault_of(plant).find("sprung_mass and backlash"), std::string::npos);
  plant.remove(effect_number("sprung_mass"));
  EXPECT_EQ(fault_of(plant), "");
}

}  // namespace
}  // namespace upright
