// Neither engine chatters nor hangs: over a grid of 200 starts and delays, and on plants made to provoke it,
// the number of events and of steps stays bounded and the state finite.
#include <gtest/gtest.h>

#include <algorithm>

#include "../unit/plants.hpp"
#include "engine_runs.hpp"
#include "sim/cvode_engine.hpp"

namespace upright {
namespace {

using namespace test;

constexpr const char* friction_models[] = {"viscous", "exponential", "dynamic"};

/// 20 starts (0.01 to 10 degrees, either side) by 10 delays (0 to 0.12 s).
std::vector<RunCase> grid(LoopForm form, double duration_s, int every) {
  std::vector<RunCase> runs;
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 10; ++j) {
      if ((i + j) % every != 0) continue;
      const double start = 0.01 * std::pow(1000.0, (i / 2) / 9.0) * std::numbers::pi / 180.0;
      runs.push_back({form, 0.12 * j / 9.0, i % 2 == 0 ? start : -start, duration_s});
    }
  return runs;
}

template <class Engine>
void expect_bounded(const Plant& plant, const std::vector<RunCase>& runs, double events_per_s,
                    double steps_per_s) {
  for (const RunCase& run : runs) {
    const RecordedRun done = record<Engine>(plant, run);
    ASSERT_FALSE(done.states.empty());
    const double ran_s = static_cast<double>(done.states.size()) * record_period_s;
    EXPECT_LT(static_cast<double>(done.event_count), 20.0 + events_per_s * ran_s)
        << run.theta0_rad << " rad, " << run.delay_s << " s";
    EXPECT_LT(static_cast<double>(done.steps), 200.0 + steps_per_s * ran_s)
        << run.theta0_rad << " rad, " << run.delay_s << " s";
    EXPECT_TRUE(std::isfinite(done.states.back().cart_m) && std::isfinite(done.states.back().theta_rad));
  }
}

Plant all_dry() {
  Plant plant = config_plant("exponential");
  plant.set("pivot_coulomb_friction", {0.003});
  plant.set("friction_asymmetry", {0.2});
  plant.set("voltage_saturation", {10.0});
  plant.set("voltage_dead_zone", {0.3});
  return plant;
}

class Grid : public testing::TestWithParam<LoopForm> {};

TEST_P(Grid, EventEngineNeitherChattersNorHangs) {
  for (const char* name : friction_models)
    expect_bounded<EventEngine<double>>(config_plant(name), grid(GetParam(), 5.0, 1), 200.0, 2e4);
  expect_bounded<EventEngine<double>>(all_dry(), grid(GetParam(), 5.0, 1), 300.0, 2e4);
}

TEST_P(Grid, ReferenceNeitherChattersNorHangs) {
  for (const char* name : friction_models)
    expect_bounded<CvodeEngine>(config_plant(name), grid(GetParam(), 0.6, 1), 200.0, 1e5);
  expect_bounded<CvodeEngine>(all_dry(), grid(GetParam(), 0.6, 3), 300.0, 1e5);
}

TEST_P(Grid, ExtremePlantsStayBounded) {
  const Plant exponential = config_plant("exponential");
  const auto with = [&](const char* kind, std::initializer_list<double> values) {
    Plant plant = exponential;
    plant.set(kind, values);
    return plant;
  };
  const std::vector<RunCase> runs = grid(GetParam(), 0.4, 7);
  const Plant plants[] = {with("bristle_friction", {1e5, 70.0}),
                          with("bristle_friction", {1e5, 0.0}),
                          with("bristle_friction", {1e7, 1e3}),
                          with("motor_lag", {1e-5}),
                          with("motor_lag", {1e-9}),
                          with("stribeck_friction", {0.43, 1e-4, 2.0}),
                          with("stribeck_friction", {0.43, 1e-4, 0.5}),
                          with("voltage_dead_zone", {1.0}),
                          with("friction_asymmetry", {0.4306291}),
                          with("pivot_coulomb_friction", {0.05})};
  for (const Plant& plant : plants) {
    const bool lag = plant.find("motor_lag") != nullptr;
    expect_bounded<EventEngine<double>>(plant, runs, 1000.0, lag ? 1e6 : 3e5);
  }
}

INSTANTIATE_TEST_SUITE_P(Forms, Grid, testing::Values(LoopForm::sampled, LoopForm::continuous),
                         [](const auto& form) {
                           return std::string(form.param == LoopForm::sampled ? "sampled" : "continuous");
                         });

// Voltages at which the load is the breakaway level to the last bit, kept for long: the edge between stick
// and slip.
TEST(Edge, LoadAtTheLevelDoesNotFlutter) {
  Plant plant = paper_plant();
  plant.pendulum.reset();
  plant.set("coulomb_friction", {0.5});
  const double edge = 0.5 / 1.7189;
  for (int ulps = -3; ulps <= 3; ++ulps) {
    double volts = edge;
    for (int i = 0; i < std::abs(ulps); ++i) volts = std::nextafter(volts, ulps > 0 ? 1.0 : 0.0);
    EventEngine<double> engine(make_model<double>(plant));
    engine.start({});
    for (int k = 0; k < 1000; ++k) engine.advance(1e-3, k % 2 == 0 ? volts : edge);
    EXPECT_LT(engine.event_count(), 4000u);
    EXPECT_LT(engine.step_count(), 20000u);
    EXPECT_NEAR(engine.state().cart_m, 0.0, 1e-12);
  }
}

}  // namespace
}  // namespace upright
