// The start of a sprung mass within a record follows from the measured motion of the cart.
#include "estimation/attached_start.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimation/fit.hpp"
#include "estimation/linearisation.hpp"
#include "plants.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {
namespace {

using test::paper_plant;

/// A run that begins at rest with the pendulum hanging, and its states at the samples.
struct Record {
  std::vector<Measurement> runs{1};
  std::vector<PlantState<double>> states;
};

Record record_of(const Plant& plant) {
  constexpr double period_s = 2e-3, duration_s = 6.0;
  Record record;
  Measurement& run = record.runs.front();
  Simulator<double> simulator(make_model<double>(plant));
  PlantState<double> hanging;
  hanging.theta_rad = std::numbers::pi;
  simulator.start(hanging);
  for (int k = 0; k * period_s <= duration_s; ++k) {
    const double t = k * period_s;
    simulator.advance_to(t);
    record.states.push_back(simulator.engine().state());
    const Outputs<double> shown = simulator.engine().outputs();
    run.time_s.push_back(t);
    run.cart_m.push_back(shown.cart_m);
    run.theta_rad.push_back(shown.theta_rad);
    run.voltage_v.push_back(2.0 * std::sin(9.0 * t) + 1.5 * std::sin(23.0 * t + 1.0));
    simulator.command(t, run.voltage_v.back());
  }
  return record;
}

Plant with(const char* kind, const std::vector<double>& values) {
  Plant plant = paper_plant();
  plant.set("viscous_friction", {3.0});
  plant.set(effect_number(kind), values);
  return plant;
}

Plant with_sprung_mass() {
  return with("sprung_mass", {0.1, 3.0, 0.05});
}

constexpr std::size_t samples_per_s = 500;

TEST(AttachedStart, FollowsFromTheMotionOfTheCart) {
  const Plant plant = with_sprung_mass();
  const Record record = record_of(plant);
  double most_m = 0.0, most_mps = 0.0;
  for (const PlantState<double>& state : record.states) {
    most_m = std::max(most_m, std::abs(state.attached_m));
    most_mps = std::max(most_mps, std::abs(state.attached_mps));
  }
  for (std::size_t first = samples_per_s / 2; first + 1 < record.states.size(); first += samples_per_s / 2) {
    PlantState<double> start = record.states[first];
    start.attached_m = start.attached_mps = 0.0;
    const MotionBefore motion(record.runs.front(), {0, first, first + 1});
    ASSERT_TRUE(motion.is_known());
    const PlantState<double> at = motion.with_mass(plant, start);
    EXPECT_NEAR(at.attached_m, record.states[first].attached_m, 0.01 * most_m) << first;
    EXPECT_NEAR(at.attached_mps, record.states[first].attached_mps, 0.01 * most_mps) << first;
  }
}

TEST(AttachedStart, IsAtRestWhereARunBeginsAtRest) {
  const Record record = record_of(with_sprung_mass());
  const MotionBefore motion(record.runs.front(), {0, 0, 10});
  ASSERT_TRUE(motion.is_known());
  PlantState<double> start = record.states[0];
  start.attached_m = start.attached_mps = 0.1;
  const PlantState<double> first = motion.with_mass(with_sprung_mass(), start);
  EXPECT_EQ(first.attached_m, 0.0);
  EXPECT_EQ(first.attached_mps, 0.0);
}

// What the cart did in a gap is not known, nor before a record that begins in motion.
TEST(AttachedStart, IsFreeSoonAfterAnUnknownMotion) {
  constexpr std::size_t gap = samples_per_s, after_s = 3;
  Record record = record_of(with_sprung_mass());
  Measurement& run = record.runs.front();
  const auto is_free_at = [&](std::size_t first) {
    return !MotionBefore(run, {0, first, first + 10}).is_known();
  };
  EXPECT_FALSE(is_free_at(gap));
  for (std::size_t k = gap; k < run.size(); ++k) run.time_s[k] += 0.1;
  EXPECT_FALSE(is_free_at(gap - 20));
  EXPECT_TRUE(is_free_at(gap));
  EXPECT_TRUE(is_free_at(gap + (after_s - 1) * samples_per_s));
  EXPECT_FALSE(is_free_at(gap + (after_s + 1) * samples_per_s));
  record = record_of(with_sprung_mass());
  for (std::vector<double>* column : {&run.time_s, &run.cart_m, &run.theta_rad, &run.voltage_v})
    column->erase(column->begin(), column->begin() + gap + 60);
  EXPECT_TRUE(is_free_at(0));
  EXPECT_TRUE(is_free_at((after_s - 1) * samples_per_s));
  EXPECT_FALSE(is_free_at((after_s + 1) * samples_per_s));
}

TEST(AttachedStart, IsFreeForOtherMasses) {
  EXPECT_TRUE(is_driven_by_cart(with_sprung_mass()));
  EXPECT_FALSE(is_driven_by_cart(with("flexible_rod", {0.3, 8.0, 0.02})));
  EXPECT_FALSE(is_driven_by_cart(with("backlash", {1e-3, 0.25, 3e4, 10.0})));
  EXPECT_FALSE(is_driven_by_cart(paper_plant()));
}

/// The slope of the objective by the parameters of the mass is that of the normal equations, also in a
/// segment that begins within the motion. Without process noise no gain depends on a parameter.
TEST(AttachedStart, HasTheSlopesOfTheObjective) {
  const Plant plant = with_sprung_mass();
  const std::size_t effect = effect_number("sprung_mass");
  const Record record = record_of(plant);
  const FitData data{&record.runs, {{0, 2 * samples_per_s, 3 * samples_per_s}}};
  FitPoint point{plant, {record.states[2 * samples_per_s]}, Noise{}};
  PlantEffect off = *plant.find(effect);
  off.values[1] *= 1.02;
  point.plant.set(effect, off.values);
  std::vector<FreeParameter> free;
  for (std::size_t index = 0; index < 3; ++index)
    free.push_back({effect, index, 0.0, 100.0, off.values[index]});
  const auto fitted_at = [&](const Plant& at) {
    FitOptions options = steps_with_fixed_noise(0);
    options.keep_equations = true;
    return fit(data, {at, point.starts, point.noise}, free, options);
  };
  const FitResult at_point = fitted_at(point.plant);
  const NormalEquations& equations = at_point.equations->front();
  for (std::size_t index = 0; index < 3; ++index) {
    const double step = 1e-4 * off.values[index];
    const auto objective_after = [&](double by) {
      PlantEffect moved = off;
      moved.values[index] += by;
      Plant other = point.plant;
      other.set(effect, moved.values);
      return fitted_at(other).objective;
    };
    const double slope = (objective_after(step) - objective_after(-step)) / (2.0 * step);
    const auto row = static_cast<Eigen::Index>(equations.score.size() - 3 + static_cast<Eigen::Index>(index));
    EXPECT_NEAR(-2.0 * equations.score[row] / slope, 1.0, 0.02) << index;
  }
}

}  // namespace
}  // namespace upright
