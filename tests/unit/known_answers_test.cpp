// Closed-form answers, on both engines.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "plants.hpp"
#include "sim/cvode_engine.hpp"
#include "sim/loop/closed_loop.hpp"

namespace upright {
namespace {

using std::numbers::pi;
using test::free_cart;
using test::paper_plant;

double energy(const Plant& plant, const PlantState<double>& s) {
  const Pendulum& p = *plant.pendulum;
  return 0.5 * (plant.cart_mass_kg + p.mass_kg) * s.cart_mps * s.cart_mps +
         p.mass_kg * p.length_to_com_m * std::cos(s.theta_rad) * s.cart_mps * s.theta_radps +
         0.5 * p.inertia_about_pivot_kgm2() * s.theta_radps * s.theta_radps +
         p.mass_kg * plant.gravity_mps2 * p.length_to_com_m * std::cos(s.theta_rad);
}

template <class Engine>
class KnownAnswers : public testing::Test {
 protected:
  static Engine engine(const Plant& plant, bool cart_locked = false, const EngineOptions& options = {}) {
    return Engine(make_model<double>(plant, cart_locked), options);
  }
  /// The voltage of a slow ramp from rest at which the cart breaks away.
  static double breakaway_v(const Plant& plant, double slope_v_per_s) {
    Engine e = engine(plant);
    e.start({});
    const double period = 1e-3;
    for (int k = 0; k < 4000; ++k) {
      const double volts = slope_v_per_s * k * period;
      e.advance(period, volts);
      if (!e.cart_at_rest()) return volts;
    }
    return 0.0;
  }
};

using Engines = testing::Types<EventEngine<double>, CvodeEngine>;
TYPED_TEST_SUITE(KnownAnswers, Engines);

TYPED_TEST(KnownAnswers, EnergyIsKeptWithoutLosses) {
  Plant plant = paper_plant();
  plant.motor.back_emf_n_per_mps = 0.0;
  auto e = this->engine(plant);
  e.start({0.0, 0.5, 0.0, 0.0});
  const double before = energy(plant, e.state());
  for (int i = 0; i < 100; ++i) e.advance(0.1, 0.0);
  EXPECT_NEAR(energy(plant, e.state()), before, 2e-8);
}

TYPED_TEST(KnownAnswers, HangingPendulumSwingsAtItsSmallAngleFrequency) {
  auto e = this->engine(paper_plant(), true);
  const double w = std::sqrt(3.0 * 9.8 / (4.0 * 0.305));
  e.start({0.0, pi + 1e-4, 0.0, 0.0});
  e.advance(2.0, 0.0);
  EXPECT_NEAR(e.state().theta_rad - pi, 1e-4 * std::cos(w * 2.0), 1e-10);
  EXPECT_EQ(e.state().cart_m, 0.0);
}

TYPED_TEST(KnownAnswers, FreeCartChangesTheHangingFrequency) {
  Plant plant = paper_plant();
  plant.motor.back_emf_n_per_mps = 0.0;
  auto e = this->engine(plant);
  const double ml = 0.21 * 0.305, inertia = 4.0 / 3.0 * ml * 0.305, mass = 1.025;
  const double w = std::sqrt(mass * ml * 9.8 / (mass * inertia - ml * ml));
  e.start({0.0, pi + 1e-4, 0.0, 0.0});
  e.advance(2.0, 0.0);
  EXPECT_NEAR(e.state().theta_rad - pi, 1e-4 * std::cos(w * 2.0), 1e-9);
}

TYPED_TEST(KnownAnswers, GivenInertiaSetsTheFrequency) {
  Plant plant = paper_plant();
  plant.pendulum->given_inertia_kgm2 = 0.03;
  auto e = this->engine(plant, true);
  e.start({0.0, pi + 1e-4, 0.0, 0.0});
  e.advance(2.0, 0.0);
  EXPECT_NEAR(e.state().theta_rad - pi, 1e-4 * std::cos(std::sqrt(0.21 * 9.8 * 0.305 / 0.03) * 2.0), 1e-10);
}

TYPED_TEST(KnownAnswers, TerminalVelocity) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.set("viscous_friction", {3.0});
  plant.set("coulomb_friction", {0.5});
  auto e = this->engine(plant);
  e.start({});
  e.advance(20.0, 2.0);
  EXPECT_NEAR(e.state().cart_mps, (1.7189 * 2.0 - 0.5) / (7.682 + 3.0), 1e-9);
}

TYPED_TEST(KnownAnswers, ViscousDecayIsExponential) {
  Plant plant = free_cart();
  plant.set("viscous_friction", {3.0});
  auto e = this->engine(plant);
  e.start({0.0, 0.0, 0.4, 0.0});
  e.advance(0.7, 0.0);
  EXPECT_NEAR(e.state().cart_mps, 0.4 * std::exp(-3.0 / 0.815 * 0.7), 1e-10);
  EXPECT_NEAR(e.state().cart_m, 0.4 * 0.815 / 3.0 * (1.0 - std::exp(-3.0 / 0.815 * 0.7)), 1e-10);
}

TYPED_TEST(KnownAnswers, BackEmfAloneBrakesTheSameWay) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  auto e = this->engine(plant);
  e.start({0.0, 0.0, -0.4, 0.0});
  e.advance(0.3, 0.0);
  EXPECT_NEAR(e.state().cart_mps, -0.4 * std::exp(-7.682 / 0.815 * 0.3), 1e-10);
}

TYPED_TEST(KnownAnswers, QuadraticDragFollowsItsClosedForm) {
  Plant plant = free_cart();
  plant.set("quadratic_drag", {2.0});
  auto e = this->engine(plant);
  e.start({0.0, 0.0, 0.5, 0.0});
  e.advance(1.0, 0.0);
  const double k = 2.0 / 0.815;
  EXPECT_NEAR(e.state().cart_mps, 0.5 / (1.0 + k * 0.5), 1e-9);
  EXPECT_NEAR(e.state().cart_m, std::log(1.0 + k * 0.5) / k, 1e-9);
}

TYPED_TEST(KnownAnswers, CoastStopsWhereTheClosedFormSaysAndStays) {
  Plant plant = free_cart();
  plant.set("coulomb_friction", {0.5});
  for (const double v : {0.3, -0.3}) {
    auto e = this->engine(plant);
    e.start({0.0, 0.0, v, 0.0});
    e.advance(2.0, 0.0);
    EXPECT_NEAR(e.state().cart_m, v * std::abs(v) / (2.0 * 0.5 / 0.815), 1e-10);
    EXPECT_EQ(e.state().cart_mps, 0.0);
    ASSERT_EQ(e.event_count(), 1u);
    EXPECT_EQ(e.event(0).kind, EventKind::cart_stick);
    EXPECT_NEAR(e.event(0).time_s, std::abs(v) * 0.815 / 0.5, 1e-10);
  }
}

TYPED_TEST(KnownAnswers, BreakawayVoltageOfASlowRampEitherWay) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.set("coulomb_friction", {0.4});
  plant.set("stribeck_friction", {0.3, 0.1, 2.0});
  EXPECT_NEAR(this->breakaway_v(plant, 0.5), 0.7 / 1.7189, 6e-4);
  EXPECT_NEAR(this->breakaway_v(plant, -0.5), -0.7 / 1.7189, 6e-4);
  plant.set("friction_asymmetry", {0.15});
  EXPECT_NEAR(this->breakaway_v(plant, 0.5), 0.85 / 1.7189, 6e-4);
  EXPECT_NEAR(this->breakaway_v(plant, -0.5), -0.55 / 1.7189, 6e-4);
  plant.remove(effect_number("friction_asymmetry"));
  plant.set("constant_force", {-0.15});
  EXPECT_NEAR(this->breakaway_v(plant, 0.5), 0.85 / 1.7189, 6e-4);
  EXPECT_NEAR(this->breakaway_v(plant, -0.5), -0.55 / 1.7189, 6e-4);
}

TYPED_TEST(KnownAnswers, HoldsBelowBreakawayForEverAndMovesAboveIt) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.set("coulomb_friction", {0.4});
  plant.set("stribeck_friction", {0.3, 0.1, 2.0});
  auto e = this->engine(plant);
  e.start({0.1});
  e.advance(10.0, 0.6999 / 1.7189);
  EXPECT_EQ(e.state().cart_m, 0.1);
  EXPECT_TRUE(e.cart_at_rest());
  e.advance(1.0, 0.7001 / 1.7189);
  EXPECT_GT(e.state().cart_m, 0.1 + 1e-5);
}

// m v' = kV - b v - Fc - F exp(-t/T) from rest.
TYPED_TEST(KnownAnswers, FrictionThatWarmsUpAsItsClosedForm) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  constexpr double fc_n = 0.4, extra_n = 0.3, constant_s = 2.0, start_s = 5.0, volts = 2.0;
  plant.set("coulomb_friction", {fc_n});
  plant.set("warming_friction", {extra_n, constant_s});
  PlantModel<double> model = make_model<double>(plant);
  model.start_s = start_s;
  TypeParam e(model, EngineOptions{});
  e.start({}, start_s);
  const double back_emf = plant.motor.back_emf_n_per_mps, mass_kg = plant.cart_mass_kg;
  const double rate = back_emf / mass_kg;
  for (int k = 1; k <= 300; ++k) {
    e.advance(0.01, volts);
    const double t = 0.01 * k, fades = std::exp(-rate * t);
    const double steady = (plant.motor.force_per_volt_n * volts - fc_n) / back_emf * (1.0 - fades);
    const double warms = extra_n / mass_kg / (rate - 1.0 / constant_s) * (std::exp(-t / constant_s) - fades);
    ASSERT_NEAR(e.state().cart_mps, steady - warms, 2e-7) << t;
  }
}

TYPED_TEST(KnownAnswers, FrictionThatWarmsUpLetsGoAtItsTime) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.set("coulomb_friction", {0.4});
  plant.set("warming_friction", {0.3, 2.0});
  const double volts = 0.5 / plant.motor.force_per_volt_n, lets_go_s = 2.0 * std::log(0.3 / 0.1);
  for (const double piece_s : {0.001, 3.0}) {
    auto e = this->engine(plant);
    e.start({0.1});
    double moved_s = 0.0;
    while (e.time_s() < 3.0) {
      e.advance(piece_s, volts);
      if (moved_s == 0.0 && e.state().cart_mps > 0.0) moved_s = e.time_s();
    }
    EXPECT_GT(e.state().cart_m, 0.1);
    if (piece_s < 0.01) {
      EXPECT_NEAR(moved_s, lets_go_s, 2.0 * piece_s);
    }
    // The cart creeps away: the force grows from nothing.
    ASSERT_GT(e.event_count(), 0u);
    EXPECT_NEAR(e.event(0).time_s, lets_go_s, 2e-3);
  }
}

// kV = Fc + mu kV, either way.
TYPED_TEST(KnownAnswers, FrictionUnderLoadLetsGoLater) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.set("coulomb_friction", {0.4});
  plant.set("load_dependent_friction", {0.2});
  EXPECT_NEAR(this->breakaway_v(plant, 0.5), 0.5 / 1.7189, 6e-4);
  EXPECT_NEAR(this->breakaway_v(plant, -0.5), -0.5 / 1.7189, 6e-4);
  auto e = this->engine(plant);
  e.start({});
  e.advance(10.0, 3.0);
  EXPECT_NEAR(e.state().cart_mps, (3.0 * 1.7189 - 0.4 / 0.8) / 7.682, 1e-7) << "it drives";
  plant.set("bristle_friction", {1e4, 70.0});
  auto bristles = this->engine(plant);
  bristles.start({});
  bristles.advance(10.0, 3.0);
  EXPECT_NEAR(bristles.state().cart_mps, (3.0 * 1.7189 - 0.4 / 0.8) / 7.682, 1e-6) << "on bristles";
}

// The stick that must hold: motor and pendulum's reaction are balanced together, so that the voltage that
// moves a cart under a leaning pendulum is not the one that moves the cart alone.
TYPED_TEST(KnownAnswers, StickBalancesMotorAndPendulumTogether) {
  Plant plant = paper_plant();
  plant.set("coulomb_friction", {0.6});
  const double theta = 0.1, ml = 0.21 * 0.305;
  // At rest th'' = 3 g sin(th) / (4 l); its reaction on the cart is -m l cos(th) th''.
  const double reaction = -ml * std::cos(theta) * 3.0 * 9.8 * std::sin(theta) / (4.0 * 0.305);
  for (const double side : {1.0, -1.0})
    for (const double excess : {-1e-4, 1e-4}) {
      auto e = this->engine(plant);
      e.start({0.0, theta, 0.0, 0.0}, 0.0, (side * (0.6 + excess) - reaction) / 1.7189);
      EXPECT_EQ(e.cart_at_rest(), excess < 0.0) << side;
    }
}

TYPED_TEST(KnownAnswers, UprightPendulumPushesTheCartOutOfStiction) {
  Plant plant = paper_plant();
  plant.set("coulomb_friction", {0.4});
  auto e = this->engine(plant);
  e.start({0.0, 0.001, 0.0, 0.0});
  e.advance(0.3, 0.0);
  EXPECT_TRUE(e.cart_at_rest());
  EXPECT_NEAR(e.state().theta_rad, 0.001 * std::cosh(std::sqrt(3.0 * 9.8 / (4.0 * 0.305)) * 0.3), 1e-8);
  e.advance(1.5, 0.0);
  EXPECT_NE(e.state().cart_m, 0.0);
}

TYPED_TEST(KnownAnswers, PivotHoldsUpToItsDryLevel) {
  Plant plant = paper_plant();
  plant.set("pivot_coulomb_friction", {0.01});
  const double holding = std::asin(0.01 / (0.21 * 9.8 * 0.305));
  for (const double factor : {0.99, 1.01}) {
    auto e = this->engine(plant, true);
    e.start({0.0, pi + factor * holding, 0.0, 0.0});
    e.advance(1.0, 0.0);
    EXPECT_EQ(e.state().theta_rad == pi + factor * holding, factor < 1.0);
  }
}

// Coulomb friction in the pivot takes the same angle from every half swing (small angles): 2 t / (m g l).
TYPED_TEST(KnownAnswers, PivotCoulombFrictionDecaysLinearly) {
  Plant plant = paper_plant();
  plant.set("pivot_coulomb_friction", {1e-5});
  auto e = this->engine(plant, true);
  const double start = 1e-3, half_swing = pi / std::sqrt(3.0 * 9.8 / (4.0 * 0.305));
  e.start({0.0, pi + start, 0.0, 0.0});
  for (int n = 1; n <= 4; ++n) {
    e.advance(half_swing, 0.0);
    const double expected = start - n * 2.0 * 1e-5 / (0.21 * 9.8 * 0.305);
    EXPECT_NEAR(std::abs(e.state().theta_rad - pi), expected, 2e-8) << n;
  }
}

TYPED_TEST(KnownAnswers, PivotViscousFrictionDampsTheSwing) {
  Plant plant = paper_plant();
  plant.set("pivot_viscous_friction", {0.002});
  auto e = this->engine(plant, true);
  const double inertia = paper_plant().pendulum->inertia_about_pivot_kgm2();
  const double w0 = std::sqrt(3.0 * 9.8 / (4.0 * 0.305)), decay = 0.002 / (2.0 * inertia);
  const double w = std::sqrt(w0 * w0 - decay * decay);
  e.start({0.0, pi + 1e-4, 0.0, 0.0});
  e.advance(3.0, 0.0);
  EXPECT_NEAR(e.state().theta_rad - pi,
              1e-4 * std::exp(-decay * 3.0) * (std::cos(w * 3.0) + decay / w * std::sin(w * 3.0)), 1e-10);
}

TYPED_TEST(KnownAnswers, PivotQuadraticDragFollowsItsClosedForm) {
  Plant plant = paper_plant();
  plant.gravity_mps2 = 0.0;
  plant.set("pivot_quadratic_drag", {0.004});
  auto e = this->engine(plant, true);
  const double k = 0.004 / plant.pendulum->inertia_about_pivot_kgm2();
  e.start({0.0, 0.0, 0.0, 3.0});
  e.advance(2.0, 0.0);
  EXPECT_NEAR(e.state().theta_radps, 3.0 / (1.0 + k * 3.0 * 2.0), 1e-8);
}

TYPED_TEST(KnownAnswers, BristlesSettleAtTheDryLevelEitherWay) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.set("coulomb_friction", {0.43});
  plant.set("stribeck_friction", {0.43, 0.105, 2.0});
  for (const double stiffness : {121.0, 1e5})
    for (const double volts : {1.0, -1.0, 3.0}) {
      plant.set("bristle_friction", {stiffness, 70.0});
      auto e = this->engine(plant);
      e.start({});
      e.advance(5.0, volts);
      const double v = e.state().cart_mps;
      const double level = std::copysign(0.43 + 0.43 * std::exp(-(v / 0.105) * (v / 0.105)), volts);
      EXPECT_NEAR(e.state().bristle_m * stiffness, level, 1e-7);
      EXPECT_NEAR(1.7189 * volts - 7.682 * v, level, 1e-6);
    }
}

TYPED_TEST(KnownAnswers, CableSpringOscillatesAboutItsCenter) {
  Plant plant = free_cart();
  plant.set("cable_spring", {5.0, 0.02});
  auto e = this->engine(plant);
  e.start({0.07});
  e.advance(2.0, 0.0);
  EXPECT_NEAR(e.state().cart_m, 0.02 + 0.05 * std::cos(std::sqrt(5.0 / 0.815) * 2.0), 1e-9);
}

TYPED_TEST(KnownAnswers, CoggingKeepsItsEnergy) {
  Plant plant = free_cart();
  plant.set("cogging_force", {0.3, 0.01, 0.4});
  auto e = this->engine(plant);
  e.start({0.0, 0.0, 0.1, 0.0});
  const auto total = [&] {
    return 0.5 * 0.815 * e.state().cart_mps * e.state().cart_mps +
           0.3 * 0.01 / (2.0 * pi) * std::cos(2.0 * pi * e.state().cart_m / 0.01 + 0.4);
  };
  const double before = total();
  e.advance(3.0, 0.0);
  EXPECT_NEAR(total(), before, 1e-6 * before);
}

TYPED_TEST(KnownAnswers, TorqueRippleDoesTheWorkOfItsForce) {
  constexpr double share = 0.3, pitch_m = 0.01, phase_rad = 0.4, volts = 1.5;
  Plant plant = free_cart();
  plant.set("torque_ripple", {share, pitch_m, phase_rad});
  auto e = this->engine(plant);
  e.start({});
  e.advance(0.7, volts);
  const double x = e.state().cart_m, v = e.state().cart_mps, turn_m = pitch_m / (2.0 * pi);
  const double ripple_m = share * turn_m * (std::cos(phase_rad) - std::cos(x / turn_m + phase_rad));
  EXPECT_GT(x, 30.0 * pitch_m);
  EXPECT_NEAR(0.5 * 0.815 * v * v, 1.7189 * volts * (x + ripple_m), 1e-7);
}

// m dv/dx = -k (1 + r sin(u))^2, which has an integral.
TYPED_TEST(KnownAnswers, TorqueRippleIsSquaredInTheBackEmf) {
  constexpr double share = 0.3, pitch_m = 0.01, phase_rad = 0.4, start_mps = 0.8;
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.set("torque_ripple", {share, pitch_m, phase_rad});
  auto e = this->engine(plant);
  e.start({0.0, 0.0, start_mps, 0.0});
  e.advance(0.2, 0.0);
  const double x = e.state().cart_m, turn_m = pitch_m / (2.0 * pi), u = x / turn_m + phase_rad;
  const double braking_m = x * (1.0 + 0.5 * share * share) +
                           2.0 * share * turn_m * (std::cos(phase_rad) - std::cos(u)) -
                           0.25 * share * share * turn_m * (std::sin(2.0 * u) - std::sin(2.0 * phase_rad));
  EXPECT_GT(x, 4.0 * pitch_m);
  EXPECT_NEAR(e.state().cart_mps, start_mps - 7.682 / 0.815 * braking_m, 1e-8);
}

TYPED_TEST(KnownAnswers, ViscousAsymmetryGivesTwoTerminalVelocities) {
  Plant plant = free_cart();
  plant.set("viscous_friction", {3.0});
  plant.set("viscous_asymmetry", {0.5});
  for (const double volts : {1.0, -1.0}) {
    auto e = this->engine(plant);
    e.start({});
    e.advance(10.0, volts);
    EXPECT_NEAR(e.state().cart_mps, 1.7189 * volts / (3.0 + (volts > 0.0 ? 0.5 : -0.5)), 1e-9);
  }
}

TYPED_TEST(KnownAnswers, MotorLagDelaysTheForceAsAFirstOrderStep) {
  Plant plant = free_cart();
  for (const double lag : {0.02, 1e-4, 1e-5}) {
    plant.set("motor_lag", {lag});
    auto e = this->engine(plant);
    e.start({});
    e.advance(0.05, 1.0);
    const double a = 1.7189 / 0.815;
    EXPECT_NEAR(e.state().motor_v, 1.0 - std::exp(-0.05 / lag), 1e-8);
    EXPECT_NEAR(e.state().cart_mps, a * (0.05 - lag * (1.0 - std::exp(-0.05 / lag))), 1e-8) << lag;
  }
}

TYPED_TEST(KnownAnswers, InputDelayShiftsTheMotionExactly) {
  Plant plant = free_cart();
  plant.set("input_delay", {0.01234});
  BasicSimulator<TypeParam, double> delayed(make_model<double>(plant));
  delayed.start({});
  delayed.command(0.0, 1.0);
  delayed.advance_to(0.012);
  EXPECT_EQ(delayed.engine().state().cart_mps, 0.0);
  delayed.advance_to(0.11234);
  EXPECT_NEAR(delayed.engine().state().cart_mps, 1.7189 / 0.815 * 0.1, 1e-10);
}

TYPED_TEST(KnownAnswers, OffsetActsAtZeroCommandAndSaturationLimitsIt) {
  Plant plant = free_cart();
  plant.set("voltage_offset", {0.2});
  auto e = this->engine(plant);
  e.start({});
  e.advance(0.5, 0.0);
  EXPECT_NEAR(e.state().cart_mps, 1.7189 * 0.2 / 0.815 * 0.5, 1e-9);
  plant.set("voltage_saturation", {5.0});
  auto limited = this->engine(plant);
  limited.start({});
  limited.advance(0.5, 100.0);
  EXPECT_NEAR(limited.state().cart_mps, 1.7189 * 5.0 / 0.815 * 0.5, 1e-9);
}

TYPED_TEST(KnownAnswers, HaltsWhereThePendulumFallsAndTheTrackEnds) {
  Plant plant = paper_plant();
  plant.motor.back_emf_n_per_mps = 0.0;
  EngineOptions options;
  options.fall_angle_rad = 0.5;
  auto falling = this->engine(plant, true, options);
  falling.start({0.0, 0.01, 0.0, 0.0});
  falling.advance(10.0, 0.0);
  ASSERT_EQ(falling.halted(), EventKind::fall);
  EXPECT_NEAR(falling.state().theta_rad, 0.5, 1e-9);
  EXPECT_LT(falling.time_s(), 2.0);
  options.track_limit_m = 0.1;
  Plant cart = free_cart();
  auto leaving = this->engine(cart, false, options);
  leaving.start({});
  leaving.advance(10.0, -1.0);
  ASSERT_EQ(leaving.halted(), EventKind::track_end);
  EXPECT_NEAR(leaving.state().cart_m, -0.1, 1e-9);
  EXPECT_NEAR(leaving.time_s(), std::sqrt(2.0 * 0.1 * 0.815 / 1.7189), 1e-9);
  leaving.start({0.2});
  leaving.advance(1.0, 0.0);
  EXPECT_EQ(leaving.halted(), EventKind::track_end);
  EXPECT_EQ(leaving.time_s(), 0.0);
}

// Continuous delayed feedback of a cart's position alone: x'' = -k x(t - delay) with constant history. By the
// method of steps: x = x0 (1 - k t^2 / 2) until the delay, then + k^2 (t - delay)^4 / 24.
TYPED_TEST(KnownAnswers, DelayedFeedbackFollowsTheMethodOfSteps) {
  const Plant plant = free_cart();
  const double k = 40.0, delay = 0.1, x0 = 0.01;
  ContinuousLoop<TypeParam> loop(make_model<double>(plant), {-k * 0.815 / 1.7189, 0.0, 0.0, 0.0}, delay);
  loop.start({x0});
  for (const double t : {0.05, 0.1, 0.15, 0.2}) {
    loop.advance_to(t);
    const double late = std::max(0.0, t - delay);
    const double expected = x0 * (1.0 - k * t * t / 2.0 + k * k * std::pow(late, 4) / 24.0);
    EXPECT_NEAR(loop.engine().state().cart_m, expected, 1e-11) << t;
  }
}

// The chain rule, with what the engine shows at close times: the encoder turns (1 + e cos(angle)) times as
// fast.
TYPED_TEST(KnownAnswers, EccentricEncoderTurnsUnevenly) {
  constexpr double share = 0.05, pitch_m = 0.06, phase_rad = 0.7, speed_mps = 0.4, step_s = 1e-4;
  Plant plant = free_cart();
  plant.set("encoder_eccentricity", {share, pitch_m, phase_rad});
  auto e = this->engine(plant);
  e.start({0.0, 0.0, speed_mps, 0.0});
  EXPECT_EQ(e.outputs().cart_m, 0.0);
  double last_m = 0.0, largest = 0.0;
  for (int k = 0; k < 2000; ++k) {
    e.advance(step_s, 0.0);
    const double middle_m = e.state().cart_m - 0.5 * speed_mps * step_s;
    const double rate_mps = (e.outputs().cart_m - last_m) / step_s;
    const double turn = 2.0 * pi * middle_m / pitch_m + phase_rad;
    EXPECT_NEAR(rate_mps, speed_mps * (1.0 + share * std::cos(turn)), 1e-6);
    last_m = e.outputs().cart_m;
    largest = std::max(largest, std::abs(last_m - e.state().cart_m));
  }
  EXPECT_GT(largest, share * pitch_m / (2.0 * pi));  // it came around
}

TYPED_TEST(KnownAnswers, UnsampledLoopsTakeTheEncoderToRunTrue) {
  Plant plant = paper_plant();
  plant.set("cart_scale", {0.9});
  plant.set("encoder_eccentricity", {0.3, 0.2, 0.5});
  const Measured seen = MeasuredState(Dynamics<double>(make_model<double>(plant)))({0.1, 0.0, 0.3, 0.0});
  EXPECT_DOUBLE_EQ(seen[0], 0.09);
  EXPECT_DOUBLE_EQ(seen[2], 0.27);
}

TYPED_TEST(KnownAnswers, SensorsScaleAndShiftWhatTheLoopSees) {
  Plant plant = paper_plant();
  plant.set("angle_offset", {0.02});
  plant.set("angle_scale", {1.1});
  plant.set("cart_scale", {0.9});
  SampledLoop<TypeParam> loop(make_model<double>(plant), 1000.0);
  loop.start({0.1, 0.2, 0.3, 0.4});
  Measured seen{};
  loop.step([&](std::uint64_t, const Measured& y) {
    seen = y;
    return 0.0;
  });
  EXPECT_DOUBLE_EQ(seen[0], 0.09);
  EXPECT_DOUBLE_EQ(seen[1], 1.1 * 0.2 + 0.02);
  EXPECT_DOUBLE_EQ(seen[2], 0.27);
  EXPECT_DOUBLE_EQ(seen[3], 1.1 * 0.4);
}

}  // namespace
}  // namespace upright
