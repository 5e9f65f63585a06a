// Sweeps: the vector engine against the event engine, the file reader, and what a sweep leaves on disk.
#include "upright/analysis/sweep.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/sim/fast_loop.hpp"
#include "upright/sim/lanes.hpp"

namespace upright {
namespace {

const std::string source = UPRIGHT_SOURCE_DIR;

LoopSetup sampled(const std::string& plant, double smoothing = 0.0) {
  LoopSetup setup;
  setup.model = make_model<double>(read_plant_file(source + "/config/plants/" + plant + ".yaml"));
  setup.model.smoothing = smoothing;
  setup.control.gains = {70.7107, 304.9273, 143.3152, 61.0833};
  setup.sampled = true;
  setup.amplifier_limit_v = 15.0;
  setup.duration_s = 5.0;
  return setup;
}

/// Runs over starts and delays, whole and fractional periods, by the lanes and one at a time.
void expect_lanes_agree(const LoopSetup& setup, double tolerance_rad) {
  ASSERT_TRUE(lanes_can_run(setup));
  std::vector<LoopCase> cases;
  for (const double delay : {0.0, 0.004, 0.0095, 0.035})
    for (const double theta0 : {0.01, 0.04, -0.08}) cases.push_back({theta0, delay});
  std::vector<LoopResult> lanes(cases.size());
  run_on_lanes(setup, cases, lanes);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    SCOPED_TRACE(std::to_string(cases[i].theta0_rad) + " rad, " + std::to_string(cases[i].delay_s) + " s");
    const LoopResult alone = run_with_events(setup, cases[i]);
    ASSERT_EQ(lanes[i].fell(), alone.fell());
    if (alone.fell()) {
      EXPECT_NEAR(lanes[i].fall_time_s, alone.fall_time_s, 1e-4);
      continue;
    }
    EXPECT_NEAR(lanes[i].end.theta_rad, alone.end.theta_rad, tolerance_rad);
    EXPECT_NEAR(lanes[i].end.cart_m, alone.end.cart_m, tolerance_rad);
    EXPECT_NEAR(lanes[i].theta_amplitude_rad, alone.theta_amplitude_rad, tolerance_rad);
  }
}

TEST(Lanes, FunctionsAreThoseOfTheLibrary) {
  std::mt19937_64 random(1);
  for (const double scale : {1e-6, 0.1, 1.0, 3.0, 40.0}) {
    std::uniform_real_distribution<double> within(-scale, scale);
    for (int repeat = 0; repeat < 200; ++repeat) {
      std::array<double, lane_count> x;
      for (double& value : x) value = within(random);
      const Lanes lanes = Lanes::load(x.data());
      const auto s = sin(lanes).values(), c = cos(lanes).values(), e = exp(lanes).values(),
                 t = tanh(lanes).values(), q = (Lanes(1.0) / lanes).values();
      for (std::size_t i = 0; i < lane_count; ++i) {
        EXPECT_NEAR(s[i], std::sin(x[i]), 1e-11);
        EXPECT_NEAR(c[i], std::cos(x[i]), 1e-11);
        EXPECT_NEAR(e[i] / std::exp(x[i]), 1.0, 1e-12);
        EXPECT_NEAR(t[i], std::tanh(x[i]), 1e-12);
        EXPECT_NEAR(q[i] * x[i], 1.0, 1e-12);
      }
    }
  }
}

TEST(FastLoop, AgreesWithTheEventEngineOnViscousFriction) {
  expect_lanes_agree(sampled("viscous"), 1e-9);
}
TEST(FastLoop, AgreesWithTheEventEngineOnSmoothFriction) {
  expect_lanes_agree(sampled("exponential", 100.0), 1e-6);
}
TEST(FastLoop, AgreesWithTheEventEngineOnStickSlip) {
  LoopSetup setup = sampled("exponential");
  setup.duration_s = 2.0;
  expect_lanes_agree(setup, 1e-6);
}
TEST(FastLoop, AgreesWithTheEventEngineOnBristles) {
  expect_lanes_agree(sampled("dynamic"), 5e-6);
}

TEST(FastLoop, AgreesWithTheEventEngineOnAnEffectOutsideTheCommonSets) {
  Plant plant = read_plant_file(source + "/config/plants/viscous.yaml");
  plant.set("cable_spring", {3.0, 0.05});
  plant.set("quadratic_drag", {1.5});
  plant.set("voltage_saturation", {9.0});
  plant.set("angle_offset", {0.003});
  LoopSetup setup = sampled("viscous");
  setup.model = make_model<double>(plant);
  expect_lanes_agree(setup, 1e-6);
}

TEST(FastLoop, LeavesToTheEventEngineWhatItCannotDo) {
  Plant plant = read_plant_file(source + "/config/plants/viscous.yaml");
  LoopSetup setup = sampled("viscous");
  plant.set("motor_lag", {0.002});
  setup.model = make_model<double>(plant);
  EXPECT_FALSE(lanes_can_run(setup));
  plant.remove(effect_number("motor_lag"));
  plant.set("pivot_coulomb_friction", {0.001});
  setup.model = make_model<double>(plant);
  EXPECT_FALSE(lanes_can_run(setup));
}

/// A folder that is gone afterwards.
class SweepFolder : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("upright-sweep-" + std::to_string(getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& text) const {
    const auto file = folder_ / "sweep.yaml";
    std::ofstream(file) << text;
    return file;
  }

  std::string text_with(const std::string& key, const std::string& value) const {
    std::vector<std::pair<std::string, std::string>> lines = {
        {"plant", source + "/config/plants/viscous.yaml"},
        {"gains", source + "/config/gains/exponential.yaml"},
        {"loop", "continuous"},
        {"theta0_deg", "[1, 3]"},
        {"delay_s", "{from: 0.0, to: 0.03, count: 7}"},
        {"duration_s", "4"},
        {"outcome", "{stable_below_rad: 0.0016, fell_above_rad: 1.0}"},
        {"engine", "fast"},
    };
    std::string text = "sweep:\n";
    for (const auto& [name, standard] : lines)
      text += "  " + name + ": " + (name == key ? value : standard) + "\n";
    return text;
  }

  static std::string content(const std::filesystem::path& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
  }

  std::filesystem::path folder_;
};

TEST_F(SweepFolder, ReadsTheGridsAsMeant) {
  const SweepConfig config = read_sweep_file(write(text_with("", "")));
  ASSERT_EQ(config.delay_s.size(), 7u);
  EXPECT_EQ(config.delay_s[3], 0.015);
  ASSERT_EQ(config.theta0_rad.size(), 2u);
  EXPECT_NEAR(config.theta0_rad[1], 0.05235987755982989, 1e-17);
}

TEST_F(SweepFolder, RefusesWhatCannotBeSwept) {
  const std::pair<const char*, const char*> wrong[] = {
      {"engine", "quick"},
      {"loop", "sometimes"},
      {"theta0_deg", "[]"},
      {"theta0_deg", "{from: 1, to: 2, count: 0}"},
      {"theta0_deg", "{from: 0, to: 2, count: 3, spacing: log}"},
      {"theta0_deg", "{from: 1, to: 2, count: 3, spacing: square}"},
      {"theta0_deg", "[1, 90]"},
      {"theta0_deg", "[3, 1]"},
      {"delay_s", "[]"},
      {"delay_s", "[0.01, 0.01]"},
      {"delay_s", "[0.02, 0.01]"},
      {"delay_s", "[-0.01, 0.01]"},
      {"delay_s", "{from: 0.1, to: 0.0, count: 5}"},
      {"delay_s", "[0.0, .nan]"},
      {"duration_s", "0"},
      {"duration_s", "soon"},
      {"outcome", "{stable_below_rad: 0.1, fell_above_rad: 0.05}"},
      {"outcome", "{stable_below_rad: 0.1, fell_above_rad: 0.1}"},
      {"outcome", "{stable_below_rad: 0.0016}"},
      {"plant", "nowhere.yaml"},
      {"gains", "nowhere.yaml"},
      {"engine", "fast\n  surprise: 1"},
  };
  for (const auto& [key, value] : wrong) {
    SCOPED_TRACE(std::string(key) + ": " + value);
    EXPECT_THROW(read_sweep_file(write(text_with(key, value))), ConfigError);
  }
}

TEST_F(SweepFolder, FindsTheCriticalDelayOfALinearPlant) {
  // Gain (7) on viscous friction alone: 0.01536 s (paper-facts). Short runs near it neither decay nor fall.
  const SweepConfig config = read_sweep_file(write(text_with("duration_s", "60")));
  const auto team = make_thread_team(config, 2);
  const SweepResult result = run_sweep(config, folder_ / "out", {}, *team);
  ASSERT_EQ(result.transitions.size(), 2u);
  for (const Transition& transition : result.transitions) {
    EXPECT_NEAR(transition.oscillates_from_s, 0.01536, 4e-4);
    EXPECT_GE(transition.falls_from_s, transition.oscillates_from_s);
  }
}

TEST_F(SweepFolder, TakesAPredictorAlong) {
  const std::string compensated = source + "/config/gains/compensated.yaml";
  EXPECT_THROW(read_sweep_file(write(text_with("gains", compensated))), ConfigError);  // a continuous loop
  std::string text = text_with("gains", compensated);
  text.replace(text.find("continuous"), 10, "sampled\n  rig: " + source + "/config/rigs/simulated.yaml");
  const SweepConfig config = read_sweep_file(write(text));
  ASSERT_TRUE(config.setup.make_compensator);
  const auto team = make_thread_team(config, 1);
  for (const SweepRun& run : run_sweep(config, folder_ / "out", {}, *team).runs) {
    EXPECT_TRUE(std::isnan(run.fall_time_s)) << run.start.delay_s;
    EXPECT_LT(run.theta_amplitude_rad, 0.02) << run.start.delay_s;
  }
}

TEST_F(SweepFolder, GivesTheSameBytesForAnyNumberOfThreadsAndAfterAStop) {
  const SweepConfig config = read_sweep_file(write(text_with("", "")));
  const auto one = make_thread_team(config, 1), three = make_thread_team(config, 3);
  run_sweep(config, folder_ / "one", {}, *one);
  run_sweep(config, folder_ / "three", {}, *three);

  std::atomic<bool> stop{false};
  SweepOptions options;
  options.stop = &stop;
  options.progress = [&stop](std::size_t done, std::size_t) { stop = done >= 5; };
  const SweepResult cut = run_sweep(config, folder_ / "cut", options, *one);
  EXPECT_TRUE(cut.interrupted);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "cut" / "sweep.csv"));
  {
    std::ofstream torn(folder_ / "cut" / "sweep.partial", std::ios::app);
    torn << "0 9 1 0.017453";  // the line that was being written
  }
  const SweepResult rest = run_sweep(config, folder_ / "cut", {}, *three);
  EXPECT_FALSE(rest.interrupted);
  EXPECT_EQ(cut.runs_made + rest.runs_made, run_sweep(config, folder_ / "again", {}, *three).runs_made);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "cut" / "sweep.partial"));
  for (const char* name : {"sweep.csv", "transitions.csv", "sweep.yaml"}) {
    EXPECT_EQ(content(folder_ / "one" / name), content(folder_ / "three" / name)) << name;
    EXPECT_EQ(content(folder_ / "one" / name), content(folder_ / "cut" / name)) << name;
  }
}

TEST_F(SweepFolder, OverwritesNothingUnasked) {
  const SweepConfig config = read_sweep_file(write(text_with("", "")));
  const auto team = make_thread_team(config, 2);
  run_sweep(config, folder_ / "out", {}, *team);
  EXPECT_THROW(run_sweep(config, folder_ / "out", {}, *team), ConfigError);
  SweepOptions options;
  options.overwrite = true;
  EXPECT_NO_THROW(run_sweep(config, folder_ / "out", options, *team));
}

TEST_F(SweepFolder, DoesNotGoOnFromAnotherSweep) {
  const SweepConfig config = read_sweep_file(write(text_with("", "")));
  const SweepConfig other = read_sweep_file(write(text_with("duration_s", "5")));
  const auto team = make_thread_team(config, 1);
  std::atomic<bool> stop{false};
  SweepOptions options;
  options.stop = &stop;
  options.progress = [&stop](std::size_t, std::size_t) { stop = true; };
  run_sweep(config, folder_ / "out", options, *team);
  EXPECT_THROW(run_sweep(other, folder_ / "out", {}, *team), ConfigError);
}

TEST_F(SweepFolder, BisectionFindsWhatTheGridFindsWithFewerRuns) {
  const SweepConfig config = read_sweep_file(write(text_with("delay_s", "{from: 0.0, to: 0.04, count: 41}")));
  const auto team = make_thread_team(config, 2);
  SweepOptions options;
  options.transitions_only = true;
  const SweepResult grid = run_sweep(config, folder_ / "grid", {}, *team);
  const SweepResult quick = run_sweep(config, folder_ / "quick", options, *team);
  EXPECT_LT(quick.runs_made * 2, grid.runs_made);
  EXPECT_EQ(content(folder_ / "grid" / "transitions.csv"), content(folder_ / "quick" / "transitions.csv"));
}

}  // namespace
}  // namespace upright
