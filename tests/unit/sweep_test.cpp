// Sweeps: the vector engine against the event engine, the file reader, and what a sweep leaves on disk.
#include "sweep/sweep.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "design/delay_margin.hpp"
#include "sim/loop/closed_loop.hpp"
#include "sim/loop/fast_loop.hpp"
#include "upright/base/error.hpp"
#include "upright/control/model_parts.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/sim/event_engine.hpp"

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

TEST(FastLoop, AgreesWithTheEventEngineOnAnUncommonEffect) {
  Plant plant = read_plant_file(source + "/config/plants/viscous.yaml");
  plant.set("cable_spring", {3.0, 0.05});
  plant.set("quadratic_drag", {1.5});
  plant.set("voltage_saturation", {9.0});
  plant.set("angle_offset", {0.003});
  LoopSetup setup = sampled("viscous");
  setup.model = make_model<double>(plant);
  expect_lanes_agree(setup, 1e-6);
}

/// A loop with an estimator that knows the viscous plant only.
LoopSetup estimating(const std::string& plant, StateEstimatorKind kind, double smoothing = 0.0) {
  LoopSetup setup = sampled(plant, smoothing);
  setup.control.gains = {47.4, 120.0, 41.0, 22.8};
  setup.control.state_estimator.kind = kind;
  setup.control.rejection.share = 1.0;
  const Plant believed = read_plant_file(source + "/config/plants/viscous.yaml");
  setup.make_parts = [believed](const ControlConfig& asked) {
    return make_model_parts(asked, believed, believed);
  };
  return setup;
}

TEST(FastLoop, AgreesWithTheEventEngineWithAKalmanFilter) {
  expect_lanes_agree(estimating("exponential", StateEstimatorKind::kalman, 100.0), 1e-6);
  expect_lanes_agree(estimating("dynamic", StateEstimatorKind::kalman), 5e-6);
}

TEST(FastLoop, AgreesWithTheEventEngineWithAPredictor) {
  for (const StateEstimatorKind kind : {StateEstimatorKind::none, StateEstimatorKind::kalman}) {
    LoopSetup setup = estimating("dynamic", kind);
    setup.control.compensation.kind = CompensationKind::predictor;
    setup.duration_s = 2.0;
    expect_lanes_agree(setup, 5e-6);
  }
}

TEST(FastLoop, FallsAndStaysUpWithAKalmanFilterAndEncoders) {
  LoopSetup setup = estimating("exponential", StateEstimatorKind::kalman);
  setup.cart_resolution_m = 2.27485e-5;
  setup.angle_resolution_rad = 1.5339808e-3;
  setup.fell_above_rad = 1.5;  // beyond the filter's linear range
  std::vector<LoopCase> cases;
  for (const double delay : {0.0, 0.012, 0.03, 0.07, 0.09, 0.12})
    for (const double theta0 : {0.01, 0.05, -0.1}) cases.push_back({theta0, delay});
  std::vector<LoopResult> lanes(cases.size());
  run_on_lanes(setup, cases, lanes);
  int fell = 0;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const LoopResult alone = run_with_events(setup, cases[i]);
    EXPECT_EQ(lanes[i].fell(), alone.fell()) << cases[i].theta0_rad << " rad, " << cases[i].delay_s << " s";
    if (alone.fell()) ++fell;
  }
  EXPECT_GT(fell, 2);
  EXPECT_LT(fell, 16);
}

TEST(Loops, ReferenceEngineTakesEstimatorsAndPredictors) {
  for (const StateEstimatorKind kind : {StateEstimatorKind::kalman, StateEstimatorKind::extended_kalman})
    for (const bool predicts : {false, true}) {
      LoopSetup setup = estimating("dynamic", kind);
      setup.duration_s = 2.0;
      if (predicts) setup.control.compensation.kind = CompensationKind::predictor;
      const LoopCase start{0.04, predicts ? 0.05 : 0.004};
      const LoopResult events = run_with_events(setup, start), reference = run_with_reference(setup, start);
      EXPECT_FALSE(events.fell());
      EXPECT_NEAR(events.end.theta_rad, reference.end.theta_rad, 1e-6);
      EXPECT_NEAR(events.end.cart_m, reference.end.cart_m, 1e-6);
    }
}

TEST(FastLoop, LeavesToTheEventEngineWhatItCannotDo) {
  EXPECT_FALSE(lanes_can_run(estimating("viscous", StateEstimatorKind::extended_kalman)));
  Plant plant = read_plant_file(source + "/config/plants/viscous.yaml");
  LoopSetup setup = sampled("viscous");
  plant.set("motor_lag", {5e-5});
  setup.model = make_model<double>(plant);
  EXPECT_FALSE(lanes_can_run(setup));
  for (const auto& [kind, value] :
       {std::pair<const char*, double>{"motor_lag", 0.002}, {"pivot_coulomb_friction", 0.001}}) {
    plant = read_plant_file(source + "/config/plants/viscous.yaml");
    plant.set(kind, {value});
    setup.model = make_model<double>(plant);
    setup.sampled = true;
    EXPECT_TRUE(lanes_can_run(setup)) << kind;
    setup.sampled = false;
    EXPECT_FALSE(lanes_can_run(setup)) << kind;
  }
  setup.sampled = true;
  for (const auto& [kind, values] :
       {std::pair<const char*, std::vector<double>>{"bristle_friction", {1e9, 70.0}},
        {"stribeck_friction", {0.43, 1e-4, 2.0}}}) {
    plant = read_plant_file(source + "/config/plants/exponential.yaml");
    plant.set(effect_number(kind), values);
    setup.model = make_model<double>(plant);
    EXPECT_FALSE(lanes_can_run(setup)) << kind;
  }
}

TEST(FastLoop, TakesStiffBristlesInSampledLoopsOnly) {
  Plant plant = read_plant_file(source + "/config/plants/dynamic.yaml");
  plant.set("bristle_friction", {1e5, 70.0});
  LoopSetup setup = sampled("dynamic");
  setup.model = make_model<double>(plant);
  EXPECT_TRUE(lanes_can_run(setup));
  setup.sampled = false;
  EXPECT_FALSE(lanes_can_run(setup));
}

TEST(FastLoop, LeavesStiffBristlesBesideLagOrPivotAlone) {
  for (const auto& [kind, value] : {std::pair<const char*, double>{"motor_lag", 0.002},
                                    {"pivot_coulomb_friction", 0.001},
                                    {"pivot_quadratic_drag", 0.001}}) {
    Plant plant = read_plant_file(source + "/config/plants/dynamic.yaml");
    LoopSetup setup = sampled("dynamic");
    plant.set(kind, {value});
    setup.model = make_model<double>(plant);
    EXPECT_TRUE(lanes_can_run(setup)) << kind;
    plant.set("bristle_friction", {1e5, 70.0});
    setup.model = make_model<double>(plant);
    EXPECT_FALSE(lanes_can_run(setup)) << kind;
  }
}

LoopSetup continuous(const std::string& plant, double smoothing = 0.0) {
  LoopSetup setup = sampled(plant, smoothing);
  setup.sampled = false;
  setup.duration_s = 1.8;
  return setup;
}

/// The event engine with steps so short that it is the truth.
LoopResult tight_run(const LoopSetup& setup, const LoopCase& start) {
  const Gains& g = setup.control.gains;
  EngineOptions options;
  options.max_step_s = 5e-5;
  options.fall_angle_rad = setup.fell_above_rad;
  ContinuousLoop<EventEngine<double>> loop(setup.model,
                                           {g.cart_position_v_per_m, g.pendulum_angle_v_per_rad,
                                            g.cart_velocity_v_per_mps, g.pendulum_rate_v_per_radps},
                                           start.delay_s, options);
  PlantState<double> state;
  state.theta_rad = start.theta0_rad;
  loop.start(state);
  MotionRange range(setup.window_begin_s());
  for (int i = 1; i <= static_cast<int>(std::lround(setup.duration_s * 2000.0)); ++i) {
    loop.advance_to(i * 5e-4);
    range.take(loop.engine().time_s(), loop.engine().state().theta_rad, loop.engine().state().cart_m);
    if (loop.engine().halted()) break;
  }
  LoopResult result;
  if (loop.engine().halted()) result.fall_time_s = loop.engine().time_s();
  range.into(result);
  result.end = loop.engine().state();
  return result;
}

void expect_continuous_lanes_hold(const LoopSetup& setup, double tolerance) {
  ASSERT_TRUE(lanes_can_run(setup));
  std::vector<LoopCase> cases;
  for (const double delay : {0.0, 0.0005, 0.0072, 0.0117, 0.045})
    for (const double theta0 : {0.003, 0.05, -0.08, 0.12}) cases.push_back({theta0, delay});
  std::vector<LoopResult> lanes(cases.size());
  run_on_lanes(setup, cases, lanes);  // more than there are lanes
  int up = 0;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    SCOPED_TRACE(std::to_string(cases[i].theta0_rad) + " rad, " + std::to_string(cases[i].delay_s) + " s");
    const LoopResult truth = tight_run(setup, cases[i]);
    ASSERT_EQ(lanes[i].fell(), truth.fell());
    if (truth.fell()) {
      EXPECT_NEAR(lanes[i].fall_time_s, truth.fall_time_s, 1e-5);
      EXPECT_NEAR(lanes[i].cart_amplitude_m, truth.cart_amplitude_m, 1e-4 * truth.cart_amplitude_m);
      continue;
    }
    ++up;
    EXPECT_NEAR(lanes[i].end.theta_rad, truth.end.theta_rad, tolerance);
    EXPECT_NEAR(lanes[i].end.cart_m, truth.end.cart_m, tolerance);
    EXPECT_NEAR(lanes[i].theta_amplitude_rad, truth.theta_amplitude_rad,
                1e-6 + 2e-3 * truth.theta_amplitude_rad);
  }
  EXPECT_GE(up, 8);
}

TEST(ContinuousLanes, HoldToTheTruthOnViscousFriction) {
  expect_continuous_lanes_hold(continuous("viscous"), 1e-6);
}
TEST(ContinuousLanes, HoldToTheTruthOnSmoothFriction) {
  expect_continuous_lanes_hold(continuous("exponential", 100.0), 1e-6);
}
TEST(ContinuousLanes, HoldToTheTruthOnStickSlip) {
  expect_continuous_lanes_hold(continuous("exponential"), 1e-6);
}
TEST(ContinuousLanes, HoldToTheTruthOnBristles) {
  expect_continuous_lanes_hold(continuous("dynamic"), 1e-6);
}

TEST(ContinuousLanes, AgreeWithActuatorCornersAndAnInputDelay) {
  for (const char* name : {"exponential", "dynamic"}) {
    Plant plant = read_plant_file(source + "/config/plants/" + name + ".yaml");
    plant.set("voltage_saturation", {8.0});
    plant.set("voltage_dead_zone", {0.1});
    plant.set("input_delay", {0.003});
    plant.set("cable_spring", {2.0, 0.02});
    LoopSetup setup = continuous("exponential");
    setup.model = make_model<double>(plant);
    setup.duration_s = 0.9;
    expect_continuous_lanes_hold(setup, 3e-6);  // growing motions make their errors grow too
  }
}

TEST(ContinuousLanes, AResultDoesNotDependOnTheRunsBesideIt) {
  for (const LoopSetup& setup : {continuous("exponential"), continuous("dynamic")}) {
    std::vector<LoopCase> cases;
    for (int i = 0; i < 40; ++i) cases.push_back({0.002 * (i + 1), 0.0009 * (i % 30)});
    std::vector<LoopResult> together(cases.size()), alone(1);
    run_on_lanes(setup, cases, together);
    for (std::size_t i = 0; i < cases.size(); i += 7) {
      run_on_lanes(setup, std::span(cases).subspan(i, 1), alone);
      EXPECT_EQ(alone[0].end.theta_rad, together[i].end.theta_rad) << i;
      EXPECT_EQ(alone[0].theta_amplitude_rad, together[i].theta_amplitude_rad) << i;
    }
  }
}

/// Small motions decay just below the delay that `upright margin` gives, and grow just above it.
TEST(ContinuousLanes, LoseStabilityAtTheCriticalDelayOfTheMargin) {
  const std::tuple<const char*, const char*, double> loops[] = {{"exponential", "exponential", 100.0},
                                                                {"viscous", "exponential", 0.0},
                                                                {"viscous", "viscous", 0.0},
                                                                {"dynamic", "dynamic", 0.0}};
  for (const auto& [plant, gains, smoothing] : loops) {
    SCOPED_TRACE(std::string(plant) + " with gains " + gains);
    LoopSetup setup = continuous(plant, smoothing);
    setup.control.gains = read_gain_file(source + "/config/gains/" + gains + ".yaml").gains;
    const double critical_s = continuous_margin(read_plant_file(source + "/config/plants/" + plant + ".yaml"),
                                                setup.control.gains, 100.0)
                                  .critical_delay_s;
    // So small that tanh and the bristles are in their linear part.
    const std::vector<LoopCase> cases = {{2e-5, 0.99 * critical_s}, {2e-5, 1.01 * critical_s}};
    std::vector<LoopResult> early(2), late(2);
    setup.duration_s = 15.0;
    run_on_lanes(setup, cases, early);
    setup.duration_s = 30.0;
    run_on_lanes(setup, cases, late);
    EXPECT_LT(late[0].theta_amplitude_rad, 0.9 * early[0].theta_amplitude_rad);
    EXPECT_TRUE(late[1].fell() || late[1].theta_amplitude_rad > 1.1 * early[1].theta_amplitude_rad);
  }
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
  const auto executor = make_thread_executor(config, 2);
  const SweepResult result = run_sweep(config, folder_ / "out", {}, *executor);
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
  ASSERT_TRUE(config.setup.make_parts);
  const auto executor = make_thread_executor(config, 1);
  for (const SweepRun& run : run_sweep(config, folder_ / "out", {}, *executor).runs) {
    EXPECT_TRUE(std::isnan(run.fall_time_s)) << run.start.delay_s;
    EXPECT_LT(run.theta_amplitude_rad, 0.02) << run.start.delay_s;
  }
}

TEST_F(SweepFolder, HasTheSameBytesForAnyThreadsAndAfterAStop) {
  const SweepConfig config = read_sweep_file(write(text_with("", "")));
  const auto one = make_thread_executor(config, 1), three = make_thread_executor(config, 3);
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

/// Lanes with stick-slip and encoders are refilled: the tasks are other ones for each engine.
TEST_F(SweepFolder, BisectionOnRefilledLanesHasTheSameBytes) {
  std::string text = text_with("plant", source + "/config/plants/exponential.yaml");
  text.replace(text.find("continuous"), 10, "sampled\n  rig: " + source + "/config/rigs/simulated.yaml");
  text.replace(text.find("[1, 3]"), 6, "{from: 0.5, to: 5, count: 12}");
  text.replace(text.find("to: 0.03, count: 7"), 18, "to: 0.08, count: 9");
  const SweepConfig config = read_sweep_file(write(text));
  ASSERT_TRUE(lanes_refill(config.setup));
  const auto one = make_thread_executor(config, 1), three = make_thread_executor(config, 3);
  SweepOptions options;
  options.transitions_only = true;
  const SweepResult alone = run_sweep(config, folder_ / "one", options, *one);
  run_sweep(config, folder_ / "three", options, *three);
  for (const char* name : {"sweep.csv", "transitions.csv"})
    EXPECT_EQ(content(folder_ / "one" / name), content(folder_ / "three" / name)) << name;
  ASSERT_EQ(alone.transitions.size(), 12u);
  const std::vector<LoopResult> runs = [&] {
    std::vector<LoopCase> cases;
    for (const SweepRun& run : alone.runs) cases.push_back(run.start);
    std::vector<LoopResult> made(cases.size());
    run_on_lanes(config.setup, cases, made);
    return made;
  }();
  std::size_t fell = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    fell += runs[i].fell() ? 1 : 0;
    EXPECT_EQ(alone.runs[i].theta_amplitude_rad, runs[i].theta_amplitude_rad) << i;
  }
  EXPECT_GT(fell, runs.size() / 8);
}

TEST_F(SweepFolder, OverwritesNothingUnasked) {
  const SweepConfig config = read_sweep_file(write(text_with("", "")));
  const auto executor = make_thread_executor(config, 2);
  run_sweep(config, folder_ / "out", {}, *executor);
  EXPECT_THROW(run_sweep(config, folder_ / "out", {}, *executor), ConfigError);
  SweepOptions options;
  options.overwrite = true;
  EXPECT_NO_THROW(run_sweep(config, folder_ / "out", options, *executor));
}

TEST_F(SweepFolder, DoesNotGoOnFromAnotherSweep) {
  const SweepConfig config = read_sweep_file(write(text_with("", "")));
  const SweepConfig other = read_sweep_file(write(text_with("duration_s", "5")));
  const auto executor = make_thread_executor(config, 1);
  std::atomic<bool> stop{false};
  SweepOptions options;
  options.stop = &stop;
  options.progress = [&stop](std::size_t, std::size_t) { stop = true; };
  run_sweep(config, folder_ / "out", options, *executor);
  EXPECT_THROW(run_sweep(other, folder_ / "out", {}, *executor), ConfigError);
}

TEST_F(SweepFolder, BisectionFindsWhatTheGridFindsWithFewerRuns) {
  const SweepConfig config = read_sweep_file(write(text_with("delay_s", "{from: 0.0, to: 0.04, count: 41}")));
  const auto executor = make_thread_executor(config, 2);
  SweepOptions options;
  options.transitions_only = true;
  const SweepResult grid = run_sweep(config, folder_ / "grid", {}, *executor);
  const SweepResult quick = run_sweep(config, folder_ / "quick", options, *executor);
  EXPECT_LT(quick.runs_made * 2, grid.runs_made);
  EXPECT_EQ(content(folder_ / "grid" / "transitions.csv"), content(folder_ / "quick" / "transitions.csv"));
}

}  // namespace
}  // namespace upright
