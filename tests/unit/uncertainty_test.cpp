// Sweeps over drawn plants: the draws, the shares and their intervals, the journal of counts.
#include "sweep/uncertainty.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "sweep/sweep.hpp"
#include "sweep/sweep_tasks.hpp"
#include "upright/base/error.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {
namespace {

namespace fs = std::filesystem;

const std::string source = UPRIGHT_SOURCE_DIR;

Plant exponential() {
  return read_plant_file(source + "/config/plants/exponential.yaml");
}

TEST(UncertainPlants, DependOnSeedAndSampleOnly) {
  const UncertainPlant uncertain(exponential(), 0.05, {});
  EXPECT_EQ(plant_text(uncertain.draw(1, 7)), plant_text(uncertain.draw(1, 7)));
  EXPECT_NE(plant_text(uncertain.draw(1, 7)), plant_text(uncertain.draw(1, 8)));
  EXPECT_NE(plant_text(uncertain.draw(1, 7)), plant_text(uncertain.draw(2, 7)));
}

TEST(UncertainPlants, FillTheIntervalEvenly) {
  const Plant plant = exponential();
  const UncertainPlant uncertain(plant, 0.05, {});
  constexpr int count = 4000;
  double sum = 0.0, squares = 0.0, low = 1e9, high = 0.0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const double by = uncertain.draw(3, i).cart_mass_kg / plant.cart_mass_kg;
    sum += by;
    squares += (by - 1.0) * (by - 1.0);
    low = std::min(low, by);
    high = std::max(high, by);
  }
  EXPECT_NEAR(sum / count, 1.0, 5e-3 * 0.5);  // five standard errors are 2.3e-3
  EXPECT_NEAR(squares / count, 0.05 * 0.05 / 3.0, 0.1 * 0.05 * 0.05 / 3.0);
  EXPECT_GE(low, 0.95);
  EXPECT_LE(high, 1.05);
  EXPECT_LT(low, 0.951);
  EXPECT_GT(high, 1.049);
}

TEST(UncertainPlants, AreThePlantWithoutUncertainty) {
  EXPECT_EQ(plant_text(UncertainPlant(exponential(), 0.0, {}).draw(1, 3)), plant_text(exponential()));
}

TEST(UncertainPlants, CarryTheInertiaWithMassAndLength) {
  Plant plant = exponential();
  const double inertia = plant.pendulum->inertia_about_pivot_kgm2(), mass = plant.pendulum->mass_kg;
  const UncertainPlant heavier(plant, 0.0, {{"pendulum.mass_kg", 1.1 * mass, 1.1 * mass}});
  EXPECT_NEAR(heavier.draw(1, 0).pendulum->inertia_about_pivot_kgm2(), 1.1 * inertia, 1e-12);
  // Point masses have the least inertia that there is.
  plant.pendulum->given_inertia_kgm2 = mass * std::pow(plant.pendulum->length_to_com_m, 2);
  const UncertainPlant point(plant, 0.2, {});
  for (std::uint32_t i = 0; i < 50; ++i) {
    const Pendulum drawn = *point.draw(1, i).pendulum;
    const double least = drawn.mass_kg * std::pow(drawn.length_to_com_m, 2);
    EXPECT_GE(drawn.inertia_about_pivot_kgm2(), least * (1.0 - 1e-12));
  }
}

TEST(UncertainPlants, TakeIntervalsAndRefuseThoseOfOtherPlants) {
  const Plant plant = exponential();
  const UncertainPlant uncertain(plant, 0.0, {{"coulomb_friction.force_n", 0.2, 0.3}});
  for (std::uint32_t i = 0; i < 20; ++i) {
    const Plant drawn = uncertain.draw(1, i);
    EXPECT_GE(drawn.find("coulomb_friction")->values[0], 0.2);
    EXPECT_LE(drawn.find("coulomb_friction")->values[0], 0.3);
    EXPECT_EQ(drawn.cart_mass_kg, plant.cart_mass_kg);
  }
  EXPECT_THROW(UncertainPlant(plant, 0.0, {{"cable_spring.stiffness_n_per_m", 1.0, 2.0}}), ConfigError);
  EXPECT_THROW(UncertainPlant(plant, 0.0, {{"cart_mass_kg", -1.0, 2.0}}), ConfigError);
}

/// Against Newcombe (Statistics in Medicine 17, 1998, table I, method 3).
TEST(Shares, HaveWilsonIntervals) {
  const std::tuple<unsigned, unsigned, double, double> published[] = {
      {81, 263, 0.2553, 0.3662}, {15, 148, 0.0624, 0.1605}, {0, 20, 0.0, 0.1611}, {1, 29, 0.0061, 0.1718}};
  for (const auto& [count, samples, low, high] : published) {
    const Share share = share_of(count, samples);
    EXPECT_NEAR(share.low, low, 5e-5);
    EXPECT_NEAR(share.high, high, 5e-5);
    EXPECT_EQ(share.value, static_cast<double>(count) / samples);
  }
  EXPECT_EQ(share_of(20, 20).high, 1.0);
}

TEST(Shares, TolerateDelaysUpToTheFirstThatMakesManyFall) {
  const auto at = [](double theta0, double delay, std::uint32_t falls) {
    return UncertainPoint{{theta0, delay}, {falls, 0}};
  };
  const std::vector<ToleratedDelay> delays = tolerated_delays(
      {at(0.1, 0.0, 0), at(0.1, 0.01, 4), at(0.1, 0.02, 5), at(0.1, 0.03, 0), at(0.2, 0.0, 9)}, 100);
  ASSERT_EQ(delays.size(), 2u);
  EXPECT_EQ(delays[0].delay_s, 0.01);
  EXPECT_EQ(delays[0].falls.value, 0.04);
  EXPECT_TRUE(std::isnan(delays[1].delay_s));
}

class UncertainSweep : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("upright-uncertain-sweep-" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  SweepConfig sweep(const std::string& uncertainty, const std::string& engine = "fast") const {
    std::ofstream(folder_ / "sweep.yaml")
        << "sweep:\n  plant: " << source << "/config/plants/exponential.yaml\n  gains: " << source
        << "/config/gains/exponential.yaml\n  loop: sampled\n  rig: " << source
        << "/config/rigs/simulated.yaml\n  theta0_deg: [1, 4]\n  delay_s: {from: 0.02, to: 0.03, count: 3}\n"
        << "  duration_s: 3\n  outcome: {stable_below_rad: 0.0016, fell_above_rad: 1.0}\n  engine: " << engine
        << "\n  uncertainty: {" << uncertainty << "}\n";
    return read_sweep_file(folder_ / "sweep.yaml");
  }
  SweepResult run(const SweepConfig& config, const std::string& name, unsigned threads = 1,
                  const SweepOptions& options = {}) const {
    const auto executor = make_thread_executor(config, threads);
    return run_sweep(config, folder_ / name, options, *executor);
  }
  std::string text(const std::string& name, const std::string& file) const {
    std::ostringstream content;
    content << std::ifstream(folder_ / name / file).rdbuf();
    return content.str();
  }

  fs::path folder_;
};

TEST_F(UncertainSweep, IsThePlainSweepWithoutUncertainty) {
  const SweepConfig config = sweep("percent: 0, samples: 3, seed: 1");
  const SweepResult result = run(config, "a");
  ASSERT_EQ(result.uncertain.size(), result.runs.size());
  int falls = 0;
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    EXPECT_EQ(result.uncertain[i].start.theta0_rad, result.runs[i].start.theta0_rad);
    EXPECT_EQ(result.uncertain[i].start.delay_s, result.runs[i].start.delay_s);
    const Outcome outcome = result.runs[i].outcome(config.stable_below_rad);
    EXPECT_EQ(result.uncertain[i].counts.falls, outcome == Outcome::fell ? 3u : 0u);
    EXPECT_EQ(result.uncertain[i].counts.oscillates, outcome == Outcome::oscillating ? 3u : 0u);
    if (outcome == Outcome::fell) ++falls;
  }
  EXPECT_GT(falls, 0);
  EXPECT_LT(falls, 6);
}

/// Each run alone on the event engine. Where an encoder step comes a period later, a fall may differ.
TEST_F(UncertainSweep, CountsAsADirectMonteCarloDoes) {
  const SweepConfig config = sweep("percent: 5, samples: 40, seed: 11");
  const SweepResult result = run(config, "a");
  for (const UncertainPoint& point : result.uncertain) {
    std::uint32_t falls = 0;
    LoopSetup setup = config.setup;
    for (std::uint32_t sample = 0; sample < 40; ++sample) {
      setup.model = make_model<double>(config.uncertainty->plants->draw(11, sample));
      if (run_with_events(setup, point.start).fell()) ++falls;
    }
    EXPECT_NEAR(point.counts.falls, falls, 1.0)
        << point.start.theta0_rad << " rad, " << point.start.delay_s << " s";
    EXPECT_GT(falls, 0u);
    EXPECT_LT(falls, 40u);
  }
}

TEST_F(UncertainSweep, GivesTheSameBytesForAnyNumberOfThreads) {
  const SweepConfig config = sweep("percent: 5, samples: 120, seed: 1", "reproducible");
  run(config, "one", 1);
  run(config, "three", 3);
  for (const char* file : {"uncertainty.csv", "sweep.csv", "transitions.csv", "sweep.yaml"})
    EXPECT_EQ(text("one", file), text("three", file)) << file;
  EXPECT_EQ(text("one", "uncertainty.csv").find(std::string(uncertainty_header) + "\n"), 0u);
}

TEST_F(UncertainSweep, GoesOnWhereItStoppedAndMakesDamagedCountsAnew) {
  const SweepConfig config = sweep("percent: 5, samples: 120, seed: 1", "reproducible");
  const std::size_t whole = run(config, "whole").runs_made;
  std::atomic<bool> stop{false};
  SweepOptions options;
  options.stop = &stop;
  options.progress = [&](std::size_t done, std::size_t known) { stop = 2 * done > known; };
  EXPECT_TRUE(run(config, "cut", 1, options).interrupted);
  EXPECT_EQ(text("cut", "uncertainty.csv"), "");
  // A digit that a disk has turned: the last count of the last line.
  std::string journal = text("cut", "sweep.partial");
  char& digit = journal[journal.size() - 4];
  digit = digit == '3' ? '4' : '3';
  std::ofstream(folder_ / "cut" / "sweep.partial") << journal;
  const SweepResult rest = run(config, "cut");
  EXPECT_LT(rest.runs_made, whole);
  EXPECT_EQ(text("cut", "uncertainty.csv"), text("whole", "uncertainty.csv"));
  EXPECT_FALSE(fs::exists(folder_ / "cut" / "sweep.partial"));
}

/// A line of counts for each group of starts and 50 plants, however many runs these are.
TEST_F(UncertainSweep, KeepsASmallJournal) {
  const SweepConfig config = sweep("percent: 5, samples: 150, seed: 1", "reproducible");
  SweepOptions options;
  std::string journal;
  options.progress = [&](std::size_t, std::size_t) { journal = text("a", "sweep.partial"); };
  run(config, "a", 1, options);
  std::size_t counts_bytes = 0;
  std::istringstream lines(journal);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("1000000 ")) counts_bytes += line.size() + 1;
  EXPECT_GT(counts_bytes, 0u);
  constexpr std::size_t runs = 900;
  EXPECT_LT(counts_bytes, runs);
}

TEST_F(UncertainSweep, EstimatesItsRunsBeforeTheFirst) {
  const SweepConfig config = sweep("percent: 5, samples: 30, seed: 1");
  SweepOptions options;
  std::size_t estimated = 0;
  options.estimated = [&](const SweepEstimate& estimate) {
    estimated = estimate.runs;
    EXPECT_GT(estimate.run_s, 0.0);
    EXPECT_FALSE(fs::exists(folder_ / "a" / "sweep.csv"));
  };
  run(config, "a", 1, options);
  EXPECT_EQ(estimated, 6u * 31u);
}

TEST_F(UncertainSweep, TakesTheIntervalsOfADiagnosedModel) {
  write_plant_file(exponential(), folder_ / "model.yaml", {},
                   {{"coulomb_friction.force_n", 0.25, 0.5}, {"stribeck_friction.shape", 1.0, 2.0}});
  const SweepConfig config = sweep("intervals: model.yaml, samples: 5, seed: 1");
  const Plant drawn = config.uncertainty->plants->draw(1, 0);
  EXPECT_EQ(drawn.cart_mass_kg, exponential().cart_mass_kg);
  EXPECT_NE(drawn.find("coulomb_friction")->values[0], exponential().find("coulomb_friction")->values[0]);
  EXPECT_NE(config.resolved_text.find("coulomb_friction.force_n from 0.25 to 0.5"), std::string::npos);
  EXPECT_EQ(plant_text(read_plant_file(folder_ / "model.yaml")), plant_text(exponential()));
}

TEST_F(UncertainSweep, RefusesWhatItCannotDrawWithFileLineAndKey) {
  write_plant_file(exponential(), folder_ / "without.yaml");
  write_plant_file(exponential(), folder_ / "other.yaml", {}, {{"coulomb_frictio.force_n", 0.1, 0.2}});
  const std::pair<const char*, const char*> wrong[] = {
      {"samples: 5, seed: 1", "percent is missing"},
      {"percent: 60, samples: 5, seed: 1", "0 to 50"},
      {"percent: 5, samples: 0, seed: 1", "samples"},
      {"percent: 5, samples: 5, seed: 1, sample: 3", "samples"},
      {"intervals: without.yaml, samples: 5, seed: 1", "upright diagnose"},
      {"intervals: other.yaml, samples: 5, seed: 1", "coulomb_friction.force_n"},
  };
  for (const auto& [uncertainty, says] : wrong) {
    SCOPED_TRACE(uncertainty);
    try {
      sweep(uncertainty);
      FAIL();
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("sweep.yaml:11"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace upright
