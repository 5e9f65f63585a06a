// The force table: what its curve reproduces, what it conserves, and that all engines follow the same one.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "model/linear_plant.hpp"
#include "plants.hpp"
#include "sim/cvode_engine.hpp"
#include "upright/base/error.hpp"
#include "upright/model/dual_number.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {
namespace {

using effects::ForceTable;
using test::free_cart;
using test::paper_plant;
using Values = std::array<double, ForceTable::first_node + ForceTable::node_count>;

double node_at(double from, double to, std::size_t k) {
  return from + (to - from) * static_cast<double>(k) / static_cast<double>(ForceTable::node_count - 1);
}

/// A table whose nodes lie on a function.
template <class F>
Values table_of(ForceTable::Over over, double from, double to, const F& f) {
  Values values{static_cast<double>(over), from, to};
  for (std::size_t k = 0; k < ForceTable::node_count; ++k)
    values[ForceTable::first_node + k] = f(node_at(from, to, k));
  return values;
}

Plant with(Plant plant, const Values& values) {
  plant.set(effect_index<ForceTable>(), values);
  return plant;
}

/// The state after two seconds of a square wave of the voltage.
template <class Engine>
PlantState<double> end_of(const Plant& plant, PlantState<double> start = {}) {
  BasicSimulator<Engine, double> simulator(make_model<double>(plant));
  simulator.start(start);
  for (int k = 0; k < 400; ++k) {
    simulator.command(0.005 * k, k % 100 < 50 ? 2.0 : -2.0);
    simulator.advance_to(0.005 * (k + 1));
  }
  return simulator.engine().state();
}

PlantState<double> hanging() {
  PlantState<double> state;
  state.theta_rad = 3.0;
  return state;
}

TEST(ForceTable, PassesThroughItsNodesWithAContinuousSlope) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  const Values p = table_of(ForceTable::position, -0.3, 0.5, [&](double) { return any(random); });
  using Dual = DualNumber<1>;
  std::array<Dual, std::tuple_size_v<Values>> dual;
  for (std::size_t i = 0; i < p.size(); ++i) dual[i] = Dual(p[i]);
  for (std::size_t k = 0; k < ForceTable::node_count; ++k) {
    const double at = node_at(-0.3, 0.5, k);
    EXPECT_NEAR(ForceTable::curve(p.data(), at), p[ForceTable::first_node + k], 1e-12);
    if (k == 0 || k + 1 == ForceTable::node_count) continue;
    const double before = ForceTable::curve(dual.data(), Dual(at - 1e-9, 0)).v[0];
    const double after = ForceTable::curve(dual.data(), Dual(at + 1e-9, 0)).v[0];
    EXPECT_NEAR(before, after, 1e-5);
  }
}

TEST(ForceTable, IsConstantBeyondItsEnds) {
  const Values p = table_of(ForceTable::position, -0.3, 0.5, [](double x) { return 2.0 * x; });
  EXPECT_EQ(ForceTable::curve(p.data(), -7.0), p[ForceTable::first_node]);
  EXPECT_EQ(ForceTable::curve(p.data(), 7.0), p.back());
  EXPECT_EQ(ForceTable::curve(p.data(), std::nan("")), p[ForceTable::first_node]);
}

TEST(ForceTable, OnAStraightLineIsViscousFriction) {
  Plant viscous = paper_plant();
  viscous.set("viscous_friction", {3.0});
  const Plant table =
      with(paper_plant(), table_of(ForceTable::velocity, -2.0, 2.0, [](double v) { return -3.0 * v; }));
  const PlantState<double> a = end_of<EventEngine<double>>(viscous, hanging());
  const PlantState<double> b = end_of<EventEngine<double>>(table, hanging());
  EXPECT_NEAR(a.cart_m, b.cart_m, 1e-9);
  EXPECT_NEAR(a.cart_mps, b.cart_mps, 1e-9);
  EXPECT_NEAR(a.theta_rad, b.theta_rad, 1e-8);
}

TEST(ForceTable, OverPositionOnAStraightLineIsASpring) {
  Plant spring = free_cart();
  spring.set("cable_spring", {4.0, 0.05});
  const Plant table = with(
      free_cart(), table_of(ForceTable::position, -1.0, 1.0, [](double x) { return -4.0 * (x - 0.05); }));
  EXPECT_NEAR(end_of<EventEngine<double>>(spring).cart_m, end_of<EventEngine<double>>(table).cart_m, 1e-8);
}

TEST(ForceTable, OverPositionAndVelocityOnALevelIsViscousFriction) {
  Plant viscous = free_cart();
  viscous.set("viscous_friction", {3.0});
  const Plant table =
      with(free_cart(), table_of(ForceTable::position_and_velocity, -1.0, 1.0, [](double) { return 3.0; }));
  EXPECT_NEAR(end_of<EventEngine<double>>(viscous).cart_m, end_of<EventEngine<double>>(table).cart_m, 1e-9);
}

TEST(ForceTable, OverPositionAndDirectionOnALevelIsCoulombFriction) {
  Plant coulomb = free_cart();
  coulomb.set("coulomb_friction", {0.8});
  const Plant table =
      with(free_cart(), table_of(ForceTable::position_and_direction, -1.0, 1.0, [](double) { return 0.8; }));
  EXPECT_TRUE(Dynamics<double>(make_model<double>(table)).cart_can_stick());
  EXPECT_NEAR(end_of<EventEngine<double>>(coulomb).cart_m, end_of<EventEngine<double>>(table).cart_m, 1e-9);
}

TEST(ForceTable, OverVelocityMakesNoContact) {
  const Plant table =
      with(free_cart(), table_of(ForceTable::velocity, -1.0, 1.0, [](double) { return 0.8; }));
  EXPECT_FALSE(Dynamics<double>(make_model<double>(table)).cart_can_stick());
}

TEST(ForceTable, OverPositionConservesEnergy) {
  Values p =
      table_of(ForceTable::position, -0.3, 0.3, [](double x) { return -8.0 * x + 0.5 * std::sin(20.0 * x); });
  Simulator<double> simulator(make_model<double>(with(free_cart(), p)));
  PlantState<double> start;
  start.cart_m = 0.25;
  simulator.start(start);
  // The work of the table between two places, by Simpson's rule over pieces far smaller than its cells.
  const auto work = [&](double from, double to) {
    constexpr int pieces = 2000;
    double sum = 0.0;
    for (int i = 0; i < pieces; ++i) {
      const double a = from + (to - from) * i / pieces, b = from + (to - from) * (i + 1) / pieces;
      sum += (b - a) / 6.0 *
             (ForceTable::curve(p.data(), a) + 4.0 * ForceTable::curve(p.data(), 0.5 * (a + b)) +
              ForceTable::curve(p.data(), b));
    }
    return sum;
  };
  for (int k = 1; k <= 40; ++k) {
    simulator.advance_to(0.1 * k);
    const PlantState<double>& s = simulator.engine().state();
    EXPECT_NEAR(0.5 * 0.815 * s.cart_mps * s.cart_mps, work(0.25, s.cart_m), 1e-6) << "after " << 0.1 * k;
  }
}

class ForceTableOver : public testing::TestWithParam<int> {};

TEST_P(ForceTableOver, IsFollowedAlikeByBothEngines) {
  const auto over = static_cast<ForceTable::Over>(GetParam());
  const Values p =
      table_of(over, -0.5, 0.5, [](double at) { return 0.6 + 0.4 * std::sin(9.0 * at) - 0.5 * at; });
  const Plant plant = with(paper_plant(), p);
  const PlantState<double> a = end_of<EventEngine<double>>(plant, hanging());
  const PlantState<double> b = end_of<CvodeEngine>(plant, hanging());
  EXPECT_NEAR(a.cart_m, b.cart_m, 2e-6);
  EXPECT_NEAR(a.theta_rad, b.theta_rad, 2e-5);
}

INSTANTIATE_TEST_SUITE_P(All, ForceTableOver, testing::Range(0, static_cast<int>(ForceTable::over_count)),
                         [](const auto& over) {
                           return std::string(ForceTable::over_words[static_cast<std::size_t>(over.param)]);
                         });

TEST(ForceTable, HasTheSlopeAtRestInALinearPlant) {
  Plant viscous = paper_plant();
  viscous.set("viscous_friction", {3.0});
  const Plant table =
      with(paper_plant(), table_of(ForceTable::velocity, -2.0, 2.0, [](double v) { return -3.0 * v; }));
  EXPECT_LT((linearize(viscous, 100.0).a - linearize(table, 100.0).a).norm(), 1e-9);
}

TEST(ForceTable, OverPositionAndDirectionIsLeftOutWhileItSlides) {
  const Plant table = with(
      paper_plant(), table_of(ForceTable::position_and_direction, -1.0, 1.0, [](double) { return 0.8; }));
  EXPECT_EQ(sliding_plant(table).find("force_table"), nullptr);
  const Plant smooth =
      with(paper_plant(), table_of(ForceTable::velocity, -1.0, 1.0, [](double) { return 0.8; }));
  EXPECT_NE(sliding_plant(smooth).find("force_table"), nullptr);
}

TEST(ForceTable, StandsInAPlantFileByTheWordOfItsQuantity) {
  const Values p = table_of(ForceTable::position_and_direction, -0.1, 0.3, [](double x) { return 1.0 + x; });
  const std::string text = plant_text(with(paper_plant(), p));
  EXPECT_NE(text.find("{kind: force_table, over: position_and_direction, from: -0.1, to: 0.3, force_01_n: "),
            std::string::npos)
      << text;
  const Plant copy = read_plant(YamlMap::from_text(text, "plant.yaml"));
  EXPECT_EQ(copy.find("force_table")->values, p);
}

TEST(ForceTable, ThatEndsBeforeItBeginsIsRefused) {
  const Values p = table_of(ForceTable::position, 0.3, 0.3, [](double) { return 1.0; });
  const std::string text = plant_text(with(paper_plant(), p));
  EXPECT_THROW(read_plant(YamlMap::from_text(text, "plant.yaml")), ConfigError);
}

}  // namespace
}  // namespace upright
