// The search for gains: known optima, the mean cost, and gains that are better on plants it did not see.
#include "sweep/gain_optimisation.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "sweep/derivative_free_search.hpp"
#include "upright/base/error.hpp"

namespace upright {
namespace {

namespace fs = std::filesystem;

const std::string source = UPRIGHT_SOURCE_DIR;

TEST(DerivativeFreeSearch, FindsAKnownMinimumWithinItsEvaluations) {
  const std::vector<double> where{0.5, -0.3, 1.4};  // the last beyond the box of the global search
  int evaluations = 0;
  const std::vector<double> found = minimise(3, {1.0, 2.0}, 1500, 1, [&](const std::vector<double>& x) {
    ++evaluations;
    double cost = 0.0;
    for (std::size_t i = 0; i < 3; ++i) cost += static_cast<double>(i + 1) * std::pow(x[i] - where[i], 2);
    return cost;
  });
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(found[i], where[i], 1e-2);
  EXPECT_LE(evaluations, 1500);
}

/// One of two minima is a trap that a local search from zero falls into.
TEST(DerivativeFreeSearch, LeavesALocalMinimum) {
  const auto cost = [](const std::vector<double>& x) {
    const double near = std::hypot(x[0] - 0.1, x[1]), far = std::hypot(x[0] + 0.8, x[1] - 0.7);
    return std::min(near, far - 0.3);
  };
  const std::vector<double> found = minimise(2, {1.0, 1.0}, 600, 1, cost);
  EXPECT_NEAR(found[0], -0.8, 1e-2);
  EXPECT_NEAR(found[1], 0.7, 1e-2);
}

TEST(DerivativeFreeSearch, KeepsTheStartWhereNothingIsBetter) {
  const auto cost = [](const std::vector<double>& x) { return x[0] == 0.0 && x[1] == 0.0 ? 0.0 : 1.0; };
  EXPECT_EQ(minimise(2, {1.0, 1.0}, 60, 1, cost), (std::vector<double>{0.0, 0.0}));
}

class GainOptimisation : public ::testing::Test {
 protected:
  void SetUp() override {
    file_ = fs::temp_directory_path() / ("upright-gain-optimisation-" + std::to_string(getpid()) + ".yaml");
  }
  void TearDown() override { fs::remove(file_); }

  SweepConfig sweep(const std::string& uncertainty, const std::string& gains = "exponential") const {
    std::ofstream(file_) << "sweep:\n  plant: " << source
                         << "/config/plants/exponential.yaml\n  gains: " << source << "/config/gains/"
                         << gains << ".yaml\n  loop: sampled\n  rig: " << source
                         << "/config/rigs/simulated.yaml\n  theta0_deg: [2, 4]\n  delay_s: [0.0, 0.03]\n"
                         << "  duration_s: 3\n  outcome: {stable_below_rad: 0.0016, fell_above_rad: 1.0}\n"
                         << "  engine: reproducible\n"
                         << uncertainty;
    return read_sweep_file(file_);
  }

  fs::path file_;
};

/// Of the commands after two thirds of a run.
double rms_v_of(const LoopSetup& setup, const LoopCase& start) {
  double squares_v2 = 0.0;
  int periods = 0;
  run_with_events(setup, start, [&](double time_s, const PlantState<double>&, double voltage_v) {
    if (time_s < setup.window_begin_s()) return;
    squares_v2 += voltage_v * voltage_v;
    ++periods;
  });
  return std::sqrt(squares_v2 / periods);
}

/// From the runs one by one, on the event engine.
TEST_F(GainOptimisation, CostIsTheMeanOverStartsDelaysAndPlants) {
  const SweepConfig config = sweep("  uncertainty: {percent: 5, samples: 3, seed: 4}\n");
  RunCost cost{2.0, 7.0, 3.0};
  double sum = 0.0, volts = 0.0;
  int falls = 0;
  LoopSetup setup = config.setup;
  for (std::uint32_t plant = 0; plant < 3; ++plant) {
    setup.model = make_model<double>(config.uncertainty->plants->draw(4, plant));
    for (const double delay_s : config.delay_s)
      for (const double theta0_rad : config.theta0_rad) {
        const LoopCase start{theta0_rad, delay_s};
        const LoopResult run = run_with_events(setup, start);
        sum += run.fell() ? 2.0 : 7.0 * run.cart_amplitude_m + 3.0 * run.theta_amplitude_rad;
        if (!run.fell()) volts += rms_v_of(setup, start);
        if (run.fell()) ++falls;
      }
  }
  const MeanCost mean = mean_cost(config, cost);
  EXPECT_EQ(mean.share_falls, falls / 12.0);
  EXPECT_GT(falls, 0);
  EXPECT_LT(falls, 12);
  EXPECT_NEAR(mean.cost, sum / 12.0, 1e-3 * sum / 12.0);
  EXPECT_EQ(mean.of_plant.size(), 3u);
  // The steps of encoders make the voltage differ between engines for good after the first other count.
  const double rms_v = volts / (12.0 - falls);
  EXPECT_NEAR(mean.voltage_rms_v, rms_v, 1e-2 * rms_v);
  cost.per_v = 0.5;
  EXPECT_NEAR(mean_cost(config, cost).cost - mean.cost, 0.5 * volts / 12.0, 1e-2 * volts / 12.0);
}

TEST_F(GainOptimisation, FindsGainsThatAreBetterOnFreshPlants) {
  const SweepConfig config = sweep("  uncertainty: {percent: 5, samples: 6, seed: 1}\n");
  OptimisationRequest request;
  request.evaluations = 20;
  const Optimisation found = optimise_gains(config, request);
  EXPECT_TRUE(found.is_better());
  EXPECT_EQ(found.fresh_seed, 2u);
  EXPECT_EQ(found.fresh_samples, 24u);
  EXPECT_LT(found.fresh_after.cost, 0.5 * found.fresh_before.cost);
  EXPECT_LE(found.after.cost, found.before.cost);
  ASSERT_EQ(found.numbers.size(), 5u);
  EXPECT_EQ(found.numbers[4].name, "velocity_estimator.cutoff_hz");
  EXPECT_EQ(found.numbers[0].after, found.control.gains.cart_position_v_per_m);
  ASSERT_EQ(found.margins_after.size(), 2u);
  EXPECT_GT(found.margins_after[1].critical_delay_s, found.margins_before[1].critical_delay_s);
}

TEST_F(GainOptimisation, TunesTheForceNoiseOfAKalmanFilter) {
  const SweepConfig config = sweep("  uncertainty: {percent: 5, samples: 1, seed: 1}\n", "quiet");
  OptimisationRequest request;
  request.evaluations = 12;
  const Optimisation found = optimise_gains(config, request), again = optimise_gains(config, request);
  ASSERT_EQ(found.numbers.size(), 5u);
  EXPECT_EQ(found.numbers[4].name, "state_estimator.cart_force_noise_n2_per_s");
  EXPECT_EQ(found.numbers[4].after, *found.control.state_estimator.cart_force_noise_n2_per_s);
  EXPECT_EQ(gain_text(found.control), gain_text(again.control)) << "the same seed gives the same gains";
  EXPECT_FALSE(found.control.state_estimator.cart_resolution_m) << "what the rig decides stays with the rig";
  EXPECT_LE(found.after.cost, found.before.cost);
  EXPECT_EQ(found.margins_before.size(), 2u);
}

/// The same search with and without a cost of the voltage.
TEST_F(GainOptimisation, AVoltageThatCostsIsSmaller) {
  const SweepConfig config = sweep("  uncertainty: {percent: 5, samples: 6, seed: 1}\n");
  OptimisationRequest request;
  request.evaluations = 40;
  const Optimisation free = optimise_gains(config, request);
  request.cost.per_v = 0.05;
  const Optimisation dear = optimise_gains(config, request);
  EXPECT_LT(dear.fresh_after.voltage_rms_v, free.fresh_after.voltage_rms_v);
}

TEST_F(GainOptimisation, TheVoltageOfAContinuousLoopHasNoCost) {
  SweepConfig config = sweep("  uncertainty: {percent: 5, samples: 1, seed: 1}\n");
  config.setup.sampled = false;
  OptimisationRequest request;
  request.cost.per_v = 1.0;
  EXPECT_THROW(optimise_gains(config, request), ConfigError);
}

TEST_F(GainOptimisation, NeedsPlants) {
  EXPECT_THROW(optimise_gains(sweep(""), {}), ConfigError);
}

}  // namespace
}  // namespace upright
