#include "upright/sim/event_engine.hpp"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <numbers>

#include "upright/model/plant_file.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {
namespace {

Plant paper_plant() {
  Plant plant;
  plant.cart_mass_kg = 0.815;
  plant.pendulum = Pendulum{0.21, 0.305, {}};
  plant.gravity_mps2 = 9.8;
  plant.motor = {1.7189, 7.682};
  return plant;
}

Plant lossless_plant() {
  Plant plant = paper_plant();
  plant.motor.back_emf_n_per_mps = 0.0;
  return plant;
}

double energy(const Plant& plant, const PlantState<double>& s) {
  const Pendulum& p = *plant.pendulum;
  return 0.5 * (plant.cart_mass_kg + p.mass_kg) * s.cart_mps * s.cart_mps +
         p.mass_kg * p.length_to_com_m * std::cos(s.theta_rad) * s.cart_mps * s.theta_radps +
         0.5 * p.inertia_about_pivot_kgm2() * s.theta_radps * s.theta_radps +
         p.mass_kg * plant.gravity_mps2 * p.length_to_com_m * std::cos(s.theta_rad);
}

TEST(EventEngine, KeepsEnergyWithoutLosses) {
  const Plant plant = lossless_plant();
  EventEngine<double> engine(make_model<double>(plant));
  engine.start({0.0, 0.5, 0.0, 0.0});
  const double before = energy(plant, engine.state());
  for (int i = 0; i < 10000; ++i) engine.advance(1e-3, 0.0);
  EXPECT_NEAR(energy(plant, engine.state()), before, 1e-8);
}

TEST(EventEngine, HangingPendulumSwingsAtItsSmallAngleFrequency) {
  const Plant plant = lossless_plant();
  EventEngine<double> engine(make_model<double>(plant, true));
  const double w = std::sqrt(3.0 * 9.8 / (4.0 * 0.305));
  engine.start({0.0, std::numbers::pi + 1e-4, 0.0, 0.0});
  engine.advance(2.0, 0.0);
  EXPECT_NEAR(engine.state().theta_rad - std::numbers::pi, 1e-4 * std::cos(w * 2.0), 1e-10);
}

TEST(EventEngine, ReachesTerminalVelocity) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.set("viscous_friction", {3.0});
  plant.set("coulomb_friction", {0.5});
  EventEngine<double> engine(make_model<double>(plant));
  engine.start({});
  engine.advance(20.0, 2.0);
  EXPECT_NEAR(engine.state().cart_mps, (1.7189 * 2.0 - 0.5) / (7.682 + 3.0), 1e-9);
}

TEST(EventEngine, HoldsBelowBreakawayAndMovesAboveIt) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.set("coulomb_friction", {0.4});
  plant.set("stribeck_friction", {0.3, 0.1, 2.0});
  EventEngine<double> engine(make_model<double>(plant));
  engine.start({});
  engine.advance(1.0, 0.6999 / 1.7189);
  EXPECT_EQ(engine.state().cart_m, 0.0);
  EXPECT_TRUE(engine.cart_at_rest());
  engine.advance(1.0, 0.7001 / 1.7189);
  EXPECT_GT(engine.state().cart_m, 1e-5);
}

TEST(EventEngine, CoastStopsWhereTheClosedFormSays) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.motor.back_emf_n_per_mps = 0.0;
  plant.set("coulomb_friction", {0.5});
  EventEngine<double> engine(make_model<double>(plant));
  engine.start({0.0, 0.0, 0.3, 0.0});
  engine.advance(2.0, 0.0);
  EXPECT_NEAR(engine.state().cart_m, 0.3 * 0.3 / (2.0 * 0.5 / 0.815), 1e-12);
  EXPECT_EQ(engine.state().cart_mps, 0.0);
}

TEST(EventEngine, UprightPendulumPushesTheCartOutOfStiction) {
  Plant plant = paper_plant();
  plant.set("coulomb_friction", {0.4});
  EventEngine<double> engine(make_model<double>(plant));
  engine.start({0.0, 0.001, 0.0, 0.0});
  engine.advance(0.3, 0.0);
  EXPECT_TRUE(engine.cart_at_rest());
  // While the cart rests the pendulum obeys th'' = 3 g sin(th) / (4 l).
  EXPECT_NEAR(engine.state().theta_rad, 0.001 * std::cosh(std::sqrt(3.0 * 9.8 / (4.0 * 0.305)) * 0.3), 1e-8);
  engine.advance(1.5, 0.0);
  EXPECT_NE(engine.state().cart_m, 0.0);
}

TEST(EventEngine, PivotHoldsUpToItsDryLevel) {
  Plant plant = paper_plant();
  plant.set("pivot_coulomb_friction", {0.01});
  const double holding = std::asin(0.01 / (0.21 * 9.8 * 0.305));
  for (const double factor : {0.99, 1.01}) {
    EventEngine<double> engine(make_model<double>(plant, true));
    engine.start({0.0, std::numbers::pi + factor * holding, 0.0, 0.0});
    engine.advance(1.0, 0.0);
    EXPECT_EQ(engine.state().theta_rad == std::numbers::pi + factor * holding, factor < 1.0);
  }
}

TEST(EventEngine, BristlesSlideAtTheDryLevel) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.set("coulomb_friction", {0.43});
  plant.set("stribeck_friction", {0.43, 0.105, 2.0});
  plant.set("bristle_friction", {121.0, 70.0});
  EventEngine<double> engine(make_model<double>(plant));
  engine.start({});
  engine.advance(5.0, 1.0);
  const double v = engine.state().cart_mps;
  const double level = 0.43 + 0.43 * std::exp(-(v / 0.105) * (v / 0.105));
  EXPECT_NEAR(engine.state().bristle_m, level / 121.0, 1e-9);
  EXPECT_NEAR(1.7189 - 7.682 * v, level, 1e-8);
}

TEST(EventEngine, ConvergesAtOrderFourBetweenEvents) {
  Plant plant = paper_plant();
  plant.set("viscous_friction", {3.0});
  const auto end = [&](double step) {
    EngineOptions options;
    options.max_step_s = step;
    options.step_fraction = 1e9;
    EventEngine<double> engine(make_model<double>(plant), options);
    engine.start({0.0, 0.4, 0.0, 0.0});
    engine.advance(1.0, 1.0);
    return engine.state().theta_rad;
  };
  const double exact = end(1e-4);
  const double ratio = (end(2e-2) - exact) / (end(1e-2) - exact);
  EXPECT_NEAR(std::log2(ratio), 4.0, 0.3);
}

// Derivatives across sticking and breakaway against central differences of whole runs.
TEST(EventEngine, DualNumbersAreRightAcrossEvents) {
  using Jet = ceres::Jet<double, 4>;
  Plant plant = paper_plant();
  plant.set("viscous_friction", {3.0});
  plant.set("coulomb_friction", {0.43});
  plant.set("stribeck_friction", {0.43, 0.105, 2.0});
  plant.set("motor_lag", {0.004});
  plant.set("input_delay", {0.0033});
  const auto run = [](auto& simulator) {
    for (int k = 0; k < 1500; ++k) {
      simulator.command(k * 2e-3, 2.0 * std::sin(k * 2e-3 * 4.0) + (k > 700 ? 0.3 : 0.0));
      simulator.advance_to((k + 1) * 2e-3);
    }
  };
  const std::size_t numbers[4] = {effect_parameter_offset(effect_number("coulomb_friction")),
                                  effect_parameter_offset(effect_number("stribeck_friction")),
                                  effect_parameter_offset(effect_number("input_delay")),
                                  effect_parameter_offset(effect_number("motor_lag"))};
  PlantModel<Jet> model = make_model<Jet>(plant);
  for (int i = 0; i < 4; ++i) model.parameters[numbers[i]].v[i] = 1.0;
  Simulator<Jet> dual(model);
  PlantState<Jet> start{};
  start.theta_rad = Jet(std::numbers::pi + 0.3);
  dual.start(start);
  run(dual);
  EXPECT_GE(dual.engine().event_count(), 6u);
  for (int i = 0; i < 4; ++i) {
    const double h = 1e-6;
    PlantState<double> ends[2];
    for (const int side : {0, 1}) {
      PlantModel<double> moved = make_model<double>(plant);
      moved.parameters[numbers[i]] += side == 0 ? -h : h;
      Simulator<double> simulator(moved);
      simulator.start({0.0, std::numbers::pi + 0.3, 0.0, 0.0});
      run(simulator);
      ends[side] = simulator.engine().state();
    }
    const double dx = (ends[1].cart_m - ends[0].cart_m) / (2.0 * h);
    const double dtheta = (ends[1].theta_rad - ends[0].theta_rad) / (2.0 * h);
    EXPECT_NEAR(dual.engine().state().cart_m.v[i], dx, 1e-4 * (1.0 + std::abs(dx))) << i;
    EXPECT_NEAR(dual.engine().state().theta_rad.v[i], dtheta, 1e-4 * (1.0 + std::abs(dtheta))) << i;
  }
}

TEST(PlantFile, WritesBackExactly) {
  for (const char* name : {"viscous", "exponential", "dynamic"}) {
    const Plant plant = read_plant_file(std::string(UPRIGHT_SOURCE_DIR) + "/config/plants/" + name + ".yaml");
    const std::string text = plant_text(plant);
    EXPECT_EQ(text, plant_text(read_plant(YamlMap::from_text(text, "copy.yaml"))));
  }
}

}  // namespace
}  // namespace upright
