// Delay compensation on the paper's stick-slip plants with the rig's limits: 15 V, encoders, 1 kHz, velocity
// filter.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "base/parallel.hpp"
#include "control/predictor.hpp"
#include "design/gain_design.hpp"
#include "design/perturbed_plant.hpp"
#include "upright/control/controller.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/sim/simulator.hpp"

namespace upright {
namespace {

constexpr double limit_v = 15.0;
constexpr double duration_s = 20.0;
constexpr double start_rad = 3.0 * std::numbers::pi / 180.0;
constexpr double fall_rad = 1.0;

Plant plant_named(const std::string& name) {
  return read_plant_file(std::string(UPRIGHT_SOURCE_DIR) + "/config/plants/" + name + ".yaml");
}

ControlConfig compensated(const Plant& model, double delay_s) {
  ControlConfig config;
  config.delay_s = delay_s;
  const auto k = design_sampled_gains(model, {}, 100.0, config.sample_rate_hz, delay_s).design.gains;
  config.gains = {k[0], k[1], k[2], k[3]};
  config.compensation.kind = CompensationKind::predictor;
  return config;
}

double counted(double value, double per_count) {
  return std::round(value / per_count) * per_count;
}

/// Seconds until the fall; the whole duration when it stays up.
double time_upright(Plant plant, Controller controller) {
  plant.set("voltage_saturation", {limit_v});
  EngineOptions options;
  options.fall_angle_rad = fall_rad;
  Simulator<double> simulator(make_model<double>(plant), options);
  PlantState<double> begin{};
  begin.theta_rad = start_rad;
  simulator.start(begin);
  const double period_s = controller.config().period_s();
  const auto ticks = static_cast<std::uint64_t>(std::lround(duration_s / period_s));
  for (std::uint64_t k = 0; k < ticks; ++k) {
    const Outputs<double> y = simulator.engine().outputs();
    const ControlOutput output = controller.step(
        {k, counted(y.cart_m, 2.275e-5), counted(y.theta_rad, 2.0 * std::numbers::pi / 4096.0), 0.0});
    const double now_s = static_cast<double>(k) * period_s;
    simulator.command(now_s, output.voltage_v);
    simulator.advance_to(now_s + period_s);
    if (simulator.engine().halted()) return now_s;
  }
  return duration_s;
}

Controller predicting(const ControlConfig& config, const Plant& model) {
  return Controller(config, limit_v, std::make_unique<Predictor>(config, model));
}

class Compensation : public testing::TestWithParam<const char*> {};

constexpr std::size_t seeds = 100;

/// How many of the seeds fall, with the controller that `make` gives for one.
template <class Make>
int falls_of(const Plant& plant, const Make& make) {
  std::atomic<int> fell{0};
  parallel_for(seeds, [&](std::size_t seed) {
    if (time_upright(plant, make(static_cast<unsigned>(seed))) < duration_s) ++fell;
  });
  return fell;
}

TEST_P(Compensation, StaysUpTo150MsWithEveryParameter5PercentOff) {
  const Plant plant = plant_named(GetParam()), model = plant_named("viscous");
  for (const double delay_s : {0.01, 0.05, 0.1, 0.15}) {
    const ControlConfig config = compensated(model, delay_s);
    EXPECT_EQ(falls_of(plant,
                       [&](unsigned seed) { return predicting(config, perturbed_plant(model, seed, 0.05)); }),
              0)
        << delay_s;
  }
}

TEST_P(Compensation, TheGainsMayComeFromTheMistakenModelToo) {
  const Plant plant = plant_named(GetParam()), model = plant_named("viscous");
  EXPECT_EQ(falls_of(plant,
                     [&](unsigned seed) {
                       const Plant off = perturbed_plant(model, seed, 0.05);
                       return predicting(compensated(off, 0.15), off);
                     }),
            0);
}

TEST_P(Compensation, StaysUpTo250MillisecondsWithExactParameters) {
  const Plant plant = plant_named(GetParam()), model = plant_named("viscous");
  for (const double delay_s : {0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25})
    EXPECT_EQ(time_upright(plant, predicting(compensated(model, delay_s), model)), duration_s) << delay_s;
}

TEST_P(Compensation, TheSameGainsWithoutItFall) {
  const Plant plant = plant_named(GetParam()), model = plant_named("viscous");
  ControlConfig config = compensated(model, 0.100);
  config.compensation.kind = CompensationKind::none;
  EXPECT_LT(time_upright(plant, Controller(config, limit_v)), duration_s);
}

INSTANTIATE_TEST_SUITE_P(Plants, Compensation, testing::Values("exponential", "dynamic"));

}  // namespace
}  // namespace upright
