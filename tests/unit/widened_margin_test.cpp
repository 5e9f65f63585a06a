// Gains with the largest delay margin for a loss of cost, against a random search.
#include "design/widened_margin.hpp"

#include <gtest/gtest.h>

#include <random>

#include "design/delay_margin.hpp"
#include "upright/base/error.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {
namespace {

constexpr double smoothing = 100.0;

struct Loop {
  Plant plant = large_motion_plant(read_plant_file(UPRIGHT_SOURCE_DIR "/config/plants/exponential.yaml"));
  DesignWeights weights;
  ControlConfig config;

  explicit Loop(double delay_s) {
    const auto k = design_sampled_gains(plant, weights, smoothing, 1000.0, 0.0).design.gains;
    config.gains = {k[0], k[1], k[2], k[3]};
    config.delay_s = delay_s;
  }
  double critical_s(const std::array<double, 4>& k) const {
    ControlConfig other = config;
    other.gains = {k[0], k[1], k[2], k[3]};
    const LoopMargin margin = sampled_margin(plant, other, smoothing, false);
    return margin.stable_without_delay ? margin.critical_delay_s : 0.0;
  }
};

TEST(WidenedMargin, KeepsItsLossAndNoRandomGainsDoBetter) {
  Loop loop(0.02);
  const GainCost cost(loop.plant, loop.weights, smoothing, loop.config.sample_rate_hz);
  const Gains start = loop.config.gains;
  const WidenedMargin found = widen_margin(loop.plant, {loop.weights, smoothing, 0.3}, loop.config);
  EXPECT_LE(found.cost_loss, 0.3);
  EXPECT_NEAR(found.cost_loss, cost.loss(found.gains), 1e-12);
  EXPECT_NEAR(found.critical_s, loop.critical_s(found.gains), 1e-12);
  EXPECT_GT(found.critical_s, 1.3 * found.lqr_critical_s);
  EXPECT_EQ(loop.config.gains.cart_position_v_per_m, found.gains[0]);
  for (const auto& pole : found.closed_loop_poles) EXPECT_LT(pole.real(), 0.0);
  std::mt19937 random(1);
  std::normal_distribution<double> any(0.0, 0.3);
  int allowed = 0;
  for (int i = 0; i < 4000; ++i) {
    const bool near_found = i % 2 == 1;
    const std::array<double, 4> from =
        near_found ? found.gains
                   : std::array{start.cart_position_v_per_m, start.pendulum_angle_v_per_rad,
                                start.cart_velocity_v_per_mps, start.pendulum_rate_v_per_radps};
    std::array<double, 4> k = from;
    for (double& gain : k) gain *= std::exp(any(random) * (near_found ? 0.1 : 1.0));
    if (cost.loss(k) > 0.3) continue;
    ++allowed;
    EXPECT_LT(loop.critical_s(k), 1.01 * found.critical_s);
  }
  EXPECT_GT(allowed, 100);
}

TEST(WidenedMargin, SaysWhenNoGainsWithinTheLossHold) {
  Loop loop(0.2);
  EXPECT_THROW(widen_margin(loop.plant, {loop.weights, smoothing, 0.3}, loop.config), ConfigError);
}

}  // namespace
}  // namespace upright
