#include "upright/sim/event_engine.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "plants.hpp"
#include "upright/model/dual_number.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {
namespace {

using test::paper_plant;

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

Plant with_bristles(double stiffness_n_per_m, double damping_n_per_mps) {
  Plant plant = paper_plant();
  plant.set("viscous_friction", {3.0});
  plant.set("coulomb_friction", {0.43});
  plant.set("stribeck_friction", {0.43, 0.105, 2.0});
  plant.set("bristle_friction", {stiffness_n_per_m, damping_n_per_mps});
  return plant;
}

TEST(EventEngine, BristlesConvergeAtOrderFourToo) {
  const auto end = [](double stiffness, double step) {
    EngineOptions options;
    options.max_step_s = step;
    options.step_fraction = 1e9;
    EventEngine<double> engine(make_model<double>(with_bristles(stiffness, 20.0)), options);
    engine.start({0.0, 0.4, 0.05, 0.0});
    engine.advance(0.2, 2.0);
    return engine.state().cart_m;
  };
  for (const double stiffness : {121.0, 2000.0}) {
    const double exact = end(stiffness, 2e-5);
    const double ratio = (end(stiffness, 2e-3) - exact) / (end(stiffness, 1e-3) - exact);
    EXPECT_NEAR(std::log2(std::abs(ratio)), 4.0, 0.6) << stiffness;
  }
}

// No step needs to resolve how fast stiff bristles relax, nor the cart's oscillation on them where that is
// damped by it.
TEST(EventEngine, StiffBristlesCostNoStepsAndNoAccuracy) {
  const auto run = [](EventEngine<double>& engine) {
    engine.start({0.0, std::numbers::pi});
    std::vector<double> cart_m;
    for (int k = 0; k < 400; ++k) {
      engine.advance(2e-3, k % 200 < 100 ? 3.0 : -3.0);
      cart_m.push_back(engine.state().cart_m);
    }
    return cart_m;
  };
  for (const double stiffness : {1e3, 4e3, 2e4, 1e5})
    for (const double damping : {0.0, 70.0}) {
      const PlantModel<double> model = make_model<double>(with_bristles(stiffness, damping));
      EngineOptions fine, coarse;
      fine.max_step_s = 2e-5;
      coarse.resolve_bristles = false;
      EventEngine<double> exact_engine(model, fine), engine(model), coarse_engine(model, coarse);
      const std::vector<double> exact = run(exact_engine);
      const auto worst_m = [&](const std::vector<double>& found) {
        double worst = 0.0;
        for (std::size_t i = 0; i < exact.size(); ++i) worst = std::max(worst, std::abs(found[i] - exact[i]));
        return worst;
      };
      EXPECT_LT(worst_m(run(engine)), 5e-8) << stiffness << ' ' << damping;
      EXPECT_LT(engine.step_count(), 3200u) << stiffness << ' ' << damping;
      EXPECT_LT(worst_m(run(coarse_engine)), 5e-7) << stiffness << ' ' << damping;
      EXPECT_LT(coarse_engine.step_count(), 1200u) << stiffness << ' ' << damping;
    }
}

// Derivatives across sticking and breakaway against central differences of whole runs.
TEST(EventEngine, DualNumbersAreRightAcrossEvents) {
  using Dual = DualNumber<4>;
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
  PlantModel<Dual> model = make_model<Dual>(plant);
  for (int i = 0; i < 4; ++i) model.parameters[numbers[i]].v.set(i, 1.0);
  Simulator<Dual> dual(model);
  PlantState<Dual> start{};
  start.theta_rad = Dual(std::numbers::pi + 0.3);
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

// The quick ones against the full ones, on the same motion, where a delay moves the ends of steps and a
// contact sticks; with a motor that lags by less than a step and by more, and with several voltages in a
// step.
void expect_quick_derivatives(double lag_s, int voltages_of_step, bool resolve_lag = true,
                              double max_step_s = 4e-3) {
  using Dual = DualNumber<8>;
  Plant plant = paper_plant();
  plant.set("viscous_friction", {3.0});
  plant.set("coulomb_friction", {0.43});
  plant.set("stribeck_friction", {0.43, 0.105, 2.0});
  plant.set("cogging_force", {0.2, 0.05, 0.3});
  plant.set("input_delay", {0.0033});
  if (lag_s > 0.0) plant.set("motor_lag", {lag_s});
  const char* names[] = {"viscous_friction", lag_s > 0.0 ? "motor_lag" : "coulomb_friction",
                         "stribeck_friction", "input_delay"};
  PlantModel<Dual> model = make_model<Dual>(plant);
  for (int i = 0; i < 4; ++i)
    model.parameters[effect_parameter_offset(effect_number(names[i]))].v.set(4 + i, 1.0);
  const auto run = [&](bool quick) {
    EngineOptions options;
    options.max_step_s = max_step_s;
    options.step_fraction = 0.5;
    options.quick_derivatives = quick;
    options.resolve_lag = resolve_lag;
    Simulator<Dual> simulator(model, options);
    PlantState<Dual> start{Dual(0.0, 0), Dual(std::numbers::pi + 0.3, 1), Dual(0.4, 2), Dual(0.0, 3)};
    simulator.start(start);
    const double held_s = voltages_of_step == 1 ? 2e-3 : 1e-3;
    for (int k = 0; k * held_s < 3.0; ++k) {
      simulator.command(k * held_s, 2.0 * std::sin(k * held_s * 4.0) + (k % 3 - 1) * 0.5);
      if ((k + 1) % voltages_of_step == 0) simulator.advance_to((k + 1) * held_s);
    }
    EXPECT_GE(simulator.engine().event_count(), 3u);
    return simulator.engine().state();
  };
  const PlantState<Dual> full = run(false), quick = run(true);
  for (Dual PlantState<Dual>::*of : {&PlantState<Dual>::cart_m, &PlantState<Dual>::theta_rad,
                                     &PlantState<Dual>::cart_mps, &PlantState<Dual>::theta_radps}) {
    EXPECT_NEAR((full.*of).a, (quick.*of).a, 1e-10);
    double largest = 0.0;
    for (int i = 0; i < 8; ++i) largest = std::max(largest, std::abs((full.*of).v[i]));
    // A voltage that varies within a step counts with its mean.
    double share = lag_s > 0.0 || voltages_of_step > 1 ? 2e-3 : 1e-3;
    if (max_step_s > 4e-3) share = 1e-2;
    for (int i = 0; i < 8; ++i) EXPECT_NEAR((full.*of).v[i], (quick.*of).v[i], share * largest) << i;
  }
}

TEST(EventEngine, QuickDerivativesAreNearlyRight) {
  for (const double lag_s : {0.0, 0.0005, 0.002, 0.02}) {
    SCOPED_TRACE(lag_s);
    expect_quick_derivatives(lag_s, 1);
    expect_quick_derivatives(lag_s, 4);
    expect_quick_derivatives(lag_s, 1, false);
    expect_quick_derivatives(lag_s, 4, false);
    expect_quick_derivatives(lag_s, 10, false, 10e-3);
  }
}

// A step of several time constants of the motor ends where steps that resolve the lag end: after 2 s under a
// voltage that reverses with each step, within a fiftieth of an encoder count.
TEST(EventEngine, AShortLagCostsNoStepsAndLittleAccuracy) {
  for (const double lag_s : {0.0005, 0.001, 0.002}) {
    SCOPED_TRACE(lag_s);
    Plant plant = paper_plant();
    plant.set("viscous_friction", {3.0});
    plant.set("motor_lag", {lag_s});
    std::uint64_t steps[2] = {};
    PlantState<double> ends[2];
    for (const bool resolve : {false, true}) {
      EngineOptions options;
      options.max_step_s = resolve ? 1e-4 : 4e-3;
      options.step_fraction = 0.5;
      options.resolve_lag = resolve;
      Simulator<double> simulator(make_model<double>(plant), options);
      simulator.start({0.0, std::numbers::pi + 0.3, 0.4, 0.0});
      for (int k = 0; k < 500; ++k) {
        simulator.command(k * 4e-3, k % 2 == 0 ? 5.0 : -5.0);
        simulator.advance_to((k + 1) * 4e-3);
      }
      steps[resolve] = simulator.engine().step_count();
      ends[resolve] = simulator.engine().state();
    }
    EXPECT_EQ(steps[false], 500u);
    EXPECT_NEAR(ends[false].cart_m, ends[true].cart_m, 1e-6);
    EXPECT_NEAR(ends[false].theta_rad, ends[true].theta_rad, 3e-5);
    EXPECT_NEAR(ends[false].cart_mps, ends[true].cart_mps, 1e-5);
  }
}

Plant with_dry_friction() {
  Plant plant = paper_plant();
  plant.set("viscous_friction", {3.0});
  plant.set("coulomb_friction", {0.43});
  return plant;
}

EngineOptions of_a_fit() {
  EngineOptions options;
  options.max_step_s = 4e-3;
  options.step_fraction = 0.5;
  options.quick_derivatives = true;
  return options;
}

// Several voltages in one step: the values are those of one step for each. An event within them leaves all
// as it was.
TEST(EventEngine, OneStepUnderSeveralVoltagesEndsAsOneForEach) {
  using Dual = DualNumber<8>;
  const Plant plant = with_dry_friction();
  const EngineOptions options = of_a_fit();
  const std::array<HeldVoltage<Dual>, 3> held = {
      {{Dual(1e-3), 4.0}, {Dual(0.5e-3), -3.0}, {Dual(1.5e-3), 1.0}}};
  const auto started = [&](double cart_mps) {
    EventEngine<Dual> engine(make_model<Dual>(plant), options);
    engine.start({Dual(0.01), Dual(std::numbers::pi + 0.3), Dual(cart_mps), Dual(-0.4)});
    engine.seed();
    return engine;
  };
  EventEngine<Dual> together = started(0.3), in_turn = started(0.3);
  ASSERT_EQ(together.advance_in_one_step(held.data(), held.size()), held.size());
  for (const auto& part : held) in_turn.advance(part.duration_s, Dual(part.voltage_v));
  EXPECT_EQ(together.time_s(), in_turn.time_s());
  EXPECT_EQ(together.state().cart_m.a, in_turn.state().cart_m.a);
  EXPECT_EQ(together.state().theta_radps.a, in_turn.state().theta_radps.a);
  EXPECT_EQ(together.state().motor_v.a, 1.0);

  EventEngine<Dual> stops = started(-0.003);
  EXPECT_EQ(stops.advance_in_one_step(held.data(), held.size()), 0u);
  EXPECT_EQ(stops.state().cart_mps.a, -0.003);
  for (int i = 0; i < 8; ++i) EXPECT_EQ(stops.state().cart_mps.v[i], started(-0.003).state().cart_mps.v[i]);
  EXPECT_EQ(stops.time_s(), 0.0);
  EXPECT_EQ(stops.event_count(), 0u);
}

// Derivatives of accelerations by the state are read from its seeds, or found beside it: as well while the
// cart slides as in the step in which it breaks away, whose velocity has no seed.
TEST(EventEngine, SeedsGiveTheSameDerivatives) {
  using Dual = DualNumber<8>;
  const Plant plant = with_dry_friction();
  const EngineOptions options = of_a_fit();
  PlantModel<Dual> model = make_model<Dual>(plant);
  model.parameters[effect_parameter_offset(effect_number("viscous_friction"))].v.set(5, 1.0);
  for (const double cart_mps : {0.3, -0.2, 0.0}) {
    PlantState<Dual> start{Dual(0.01), Dual(std::numbers::pi + 0.3), Dual(cart_mps), Dual(-0.4)};
    EventEngine<Dual> seeded(model, options), plain(model, options);
    seeded.start(start);
    seeded.seed();
    plain.start(start);
    PlantState<Dual> unit = seeded.state();
    plain.correct(unit);
    seeded.advance(Dual(2e-3), Dual(4.0));
    plain.advance(Dual(2e-3), Dual(4.0));
    EXPECT_NE(seeded.state().cart_mps.a, cart_mps);
    for (Dual PlantState<Dual>::*of : {&PlantState<Dual>::cart_m, &PlantState<Dual>::theta_rad,
                                       &PlantState<Dual>::cart_mps, &PlantState<Dual>::theta_radps}) {
      EXPECT_EQ((seeded.state().*of).a, (plain.state().*of).a);
      for (int i = 0; i < 8; ++i) EXPECT_NEAR((seeded.state().*of).v[i], (plain.state().*of).v[i], 1e-7) << i;
    }
  }
}

// A cart that the pendulum tears loose for less than a step and that friction stops again at once: neither
// missed nor repeated without end.
TEST(EventEngine, DualNumbersAreRightThroughStiffBristles) {
  using Dual = DualNumber<2>;
  const auto run = []<class Number>(EventEngine<Number>& engine) {
    for (int k = 0; k < 600; ++k) engine.advance(Number(2e-3), Number(2.0 * std::sin(k * 2e-3 * 9.0)));
  };
  const Plant plant = with_bristles(8000.0, 30.0);
  const std::size_t stiffness = effect_parameter_offset(effect_number("bristle_friction"));
  const std::size_t level = effect_parameter_offset(effect_number("coulomb_friction"));
  PlantModel<Dual> model = make_model<Dual>(plant);
  model.parameters[stiffness].v.set(0, 1.0);
  model.parameters[level].v.set(1, 1.0);
  EventEngine<Dual> dual(model);
  dual.start({});
  run(dual);
  for (int i = 0; i < 2; ++i) {
    const std::size_t number = i == 0 ? stiffness : level;
    const double aside = i == 0 ? 20.0 : 1e-4;
    const auto end = [&](double by) {
      PlantModel<double> other = make_model<double>(plant);
      other.parameters[number] += by;
      EventEngine<double> engine(other);
      engine.start({});
      run(engine);
      return engine.state().cart_m;
    };
    const double difference = (end(aside) - end(-aside)) / (2.0 * aside);
    EXPECT_NEAR(dual.state().cart_m.v[i], difference, 0.01 * std::abs(difference)) << i;
  }
}

TEST(EventEngine, MicroSlipWithinOneStepIsOneSlip) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.set("coulomb_friction", {0.5});
  EventEngine<double> engine(make_model<double>(plant));
  engine.start({});
  engine.advance(1e-4, 0.5001 / 1.7189);  // breaks away
  engine.advance(0.0105, -0.2);           // and is pulled back to rest well within the first step
  ASSERT_EQ(engine.event_count(), 1u);
  EXPECT_EQ(engine.event(0).kind, EventKind::cart_stick);
  EXPECT_LT(engine.event(0).time_s, 1.1e-4 + 1e-6);
  EXPECT_TRUE(engine.cart_at_rest());
}

}  // namespace
}  // namespace upright
