// Closed-form answers of a mass with a motion of its own, on both engines: a sprung mass, the motor behind
// its backlash, and a rod that bends.
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

/// The paper's plant without losses, whose rod bends.
Plant plant_with_rod(double share, double frequency_hz, double damping_ratio) {
  Plant plant = paper_plant();
  plant.motor.back_emf_n_per_mps = 0.0;
  plant.set("flexible_rod", {share, frequency_hz, damping_ratio});
  return plant;
}

/// The distance of the vibrating mass from the pivot [m].
double lever_of_rod(const Plant& plant) {
  return 1.08975 * plant.pendulum->inertia_about_pivot_kgm2() /
         (plant.pendulum->mass_kg * plant.pendulum->length_to_com_m);
}

// Gravity is left out, and friction holds the cart.
TYPED_TEST(AttachedMassMotion, FlexibleRodVibratesOnAFreePivot) {
  constexpr double share = 0.6, frequency_hz = 5.0, damping_ratio = 0.04, q0_m = 1e-4;
  Plant plant = plant_with_rod(share, frequency_hz, damping_ratio);
  plant.gravity_mps2 = 1e-12;
  plant.set("coulomb_friction", {5.0});
  auto e = engine_of<TypeParam>(plant);
  PlantState<double> start{0.1};
  start.attached_m = q0_m;
  e.start(start);
  const double lever_m = lever_of_rod(plant);
  for (int k = 1; k <= 200; ++k) {
    e.advance(0.005, 0.0);
    const double q_m = q0_m * free_swing(2.0 * std::numbers::pi * frequency_hz, damping_ratio, 0.005 * k);
    ASSERT_NEAR(e.state().attached_m, q_m, 1e-4 * q0_m) << k;
    ASSERT_NEAR(e.state().theta_rad, share * (q0_m - q_m) / lever_m, 1e-4 * q0_m / lever_m) << k;
    ASSERT_EQ(e.state().cart_m, 0.1) << k;
  }
}

/// Kinetic and potential energy, from the places of the bodies.
double energy_of_rod(const Plant& plant, double share, double frequency_hz, const PlantState<double>& s) {
  const double moment = plant.pendulum->mass_kg * plant.pendulum->length_to_com_m;
  const double inertia = plant.pendulum->inertia_about_pivot_kgm2(), g = plant.gravity_mps2;
  const double h = lever_of_rod(plant), m = share * inertia / (h * h),
               w = 2.0 * std::numbers::pi * frequency_hz;
  const double sine = std::sin(s.theta_rad), cosine = std::cos(s.theta_rad), q = s.attached_m;
  const double across_mps = h * s.theta_radps + s.attached_mps, along_mps = q * s.theta_radps;
  const double vx = s.cart_mps + across_mps * cosine - along_mps * sine;
  const double vy = -across_mps * sine - along_mps * cosine;
  const double rest_kg = plant.cart_mass_kg + plant.pendulum->mass_kg - m, rest_moment = moment - m * h;
  const double rest_kgm2 = inertia - m * h * h;
  return 0.5 * rest_kg * s.cart_mps * s.cart_mps + rest_moment * cosine * s.cart_mps * s.theta_radps +
         0.5 * rest_kgm2 * s.theta_radps * s.theta_radps + 0.5 * m * (vx * vx + vy * vy) +
         g * (rest_moment * cosine + m * (h * cosine - q * sine)) + 0.5 * m * (1.0 - share) * w * w * q * q;
}

TYPED_TEST(AttachedMassMotion, FlexibleRodKeepsTheEnergy) {
  constexpr double share = 0.5, frequency_hz = 3.0;
  const Plant plant = plant_with_rod(share, frequency_hz, 0.0);
  auto e = engine_of<TypeParam>(plant);
  PlantState<double> start{0.1, 2.0};
  start.theta_radps = 3.0;
  start.attached_m = 0.03;
  e.start(start);
  const double energy = energy_of_rod(plant, share, frequency_hz, start);
  for (int k = 1; k <= 100; ++k) {
    e.advance(0.01, 0.0);
    ASSERT_NEAR(energy_of_rod(plant, share, frequency_hz, e.state()), energy, 1e-7) << k;
  }
  EXPECT_GT(std::abs(e.state().attached_m - start.attached_m), 1e-3);
}

// Dry friction holds the pivot until the rod pulls harder. The cart stays where it is.
TYPED_TEST(AttachedMassMotion, FlexibleRodVibratesOnAStickingPivot) {
  constexpr double share = 0.6, frequency_hz = 5.0, damping_ratio = 0.04;
  Plant plant = plant_with_rod(share, frequency_hz, damping_ratio);
  plant.gravity_mps2 = 1e-12;
  plant.set("pivot_coulomb_friction", {0.01});
  plant.set("coulomb_friction", {5.0});
  const double held_radps = 2.0 * std::numbers::pi * frequency_hz * std::sqrt(1.0 - share);
  const double inertia = plant.pendulum->inertia_about_pivot_kgm2();
  const double holds_m = 0.01 * lever_of_rod(plant) / (share * inertia * held_radps * held_radps);  // at most
  for (const double part : {0.99, 1.01}) {
    auto e = engine_of<TypeParam>(plant);
    PlantState<double> start{0.1};
    start.attached_m = part * holds_m;
    e.start(start);
    e.advance(0.01, 0.0);
    EXPECT_EQ(e.state().theta_rad == 0.0, part < 1.0);
    EXPECT_EQ(e.state().cart_m, 0.1);
    if (part > 1.0) continue;
    for (int k = 1; k <= 100; ++k) e.advance(0.005, 0.0);
    EXPECT_EQ(e.state().theta_rad, 0.0);
    const double held_ratio = damping_ratio * std::sqrt(1.0 - share);
    EXPECT_NEAR(e.state().attached_m, start.attached_m * free_swing(held_radps, held_ratio, 0.51),
                1e-4 * holds_m);
  }
}

TEST(PlantWithAttachedMass, HasOneAtMost) {
  Plant plant = paper_plant();
  plant.set("sprung_mass", {0.1, 6.0, 0.05});
  EXPECT_EQ(fault_of(plant), "");
  plant.set("backlash", {2e-4, 0.2, 1e5, 10.0});
  EXPECT_NE(fault_of(plant).find("sprung_mass and backlash"), std::string::npos);
  plant.remove(effect_number("sprung_mass"));
  EXPECT_EQ(fault_of(plant), "");
  plant.set("flexible_rod", {0.3, 10.0, 0.02});
  EXPECT_NE(fault_of(plant).find("backlash and flexible_rod"), std::string::npos);
  plant.remove(effect_number("backlash"));
  EXPECT_EQ(fault_of(plant), "");
  plant.pendulum.reset();
  EXPECT_NE(fault_of(plant).find("no pendulum"), std::string::npos);
}

}  // namespace
}  // namespace upright
