// An unattended delay sweep goes on after each fall: the cart comes back from wherever the fall left it, the
// pendulum is reduced_process_noise and swung up again, until both transitions are found.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>

#include "control/predictor.hpp"
#include "experiment/experiment.hpp"
#include "record/run_log.hpp"
#include "runtime/control_loop.hpp"
#include "upright/base/error.hpp"
#include "upright/control/controller.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {
namespace {

namespace fs = std::filesystem;

const fs::path config = fs::path(UPRIGHT_SOURCE_DIR) / "config";

class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "upright-return-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

ExperimentSetup setup_with(const std::string& piece, const std::string& plant) {
  ExperimentSetup setup;
  setup.experiment = read_experiment_text(
      "experiment:\n  name: test\n  why: a test\n  gains: ../gains/exponential.yaml\n  travel_m: 0.34\n"
      "  voltage_limit_v: 10\n  pieces:\n    - " +
          piece + "\n",
      config / "experiments" / "test.yaml");
  setup.rig = read_rig_file(config / "rigs" / "simulated.yaml");
  setup.rig.amplifier.limit_v = 10.0;
  setup.rig.simulated->cart_noise_m = 1e-5;  // so that seeds differ
  setup.rig.simulated->theta_noise_rad = 2e-4;
  setup.plant = read_plant_file(config / "plants" / plant);
  setup.simulated = setup.plant;
  setup.control = read_gain_file(config / "gains" / "exponential.yaml");
  return setup;
}

/// The largest |x| of a run's rows.
double farthest_of(const fs::path& run) {
  double farthest_m = 0.0;
  for (const LogRecord& row : read_samples(run / "samples.csv").rows)
    farthest_m = std::max(farthest_m, std::abs(row.cart_m));
  return farthest_m;
}

class UnattendedSweep : public ::testing::TestWithParam<const char*> {};

TEST_P(UnattendedSweep, ComesBackAfterEachFallAndFindsItsTransitions) {
  constexpr std::uint64_t seeds = 4;
  int falls = 0, beyond = 0;
  double farthest_m = 0.0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    // From rest, the dynamic friction bears more than 70 ms.
    ExperimentSetup setup = setup_with(
        "{kind: delay_sweep, delay_s: [0, 0.035, 0.07, 0.1, 0.2], duration_s: 5, repeats: 2, bisect_to_s: "
        "0.012, start: "
        "swing_up}",
        GetParam());
    // Without a coasting time in the rig file a fall carries the cart beyond the track limit.
    if (seed % 2 == 0) setup.rig.coast_s = 0.0;
    const Folder folder;
    VirtualClock clock;
    const auto rig = make_simulated_rig(setup.rig, setup.plant, clock, {seed, {}});
    const SignalFlag signal{0};
    ExperimentOptions options;
    options.folder = folder.path() / "out";
    const ExperimentResult result =
        run_experiment(setup, plan_pieces(setup), *rig, rig.get(), clock, signal, options);
    ASSERT_TRUE(result.complete) << "seed " << seed << ": " << result.sentence;
    for (const TrialResult& r : result.trials) {
      EXPECT_TRUE(r.outcome == "stable" || r.outcome == "oscillating" || r.outcome == "fell") << r.outcome;
      EXPECT_GT(r.theta_amplitude_rad, 0.0);
      EXPECT_GT(r.cart_amplitude_m, 0.0);
      const double reached_m = farthest_of(options.folder / r.run_directory);
      farthest_m = std::max(farthest_m, reached_m);
      beyond += reached_m > setup.rig.track_limit_m ? 1 : 0;
      falls += r.outcome == "fell" ? 1 : 0;
    }
    EXPECT_EQ(missing_transitions(setup.experiment.pieces, result.trials), "");
  }
  std::printf("%s: %d falls, %d runs beyond the track limit, farthest %.3f m\n", GetParam(), falls, beyond,
              farthest_m);
  EXPECT_GE(falls, 2 * static_cast<int>(seeds));
  EXPECT_GT(beyond, 0) << "the return from beyond the limit was not tried";
}

INSTANTIATE_TEST_SUITE_P(Plants, UnattendedSweep, ::testing::Values("exponential.yaml", "dynamic.yaml"));

/// Keeps a record of the plant's, and may have the amplifier's wires the wrong way round.
class WitnessedRig final : public Rig {
 public:
  WitnessedRig(Rig& rig, double sign, const Calibration& calibration)
      : rig_(rig), sign_(sign), scaler_(calibration) {}

  void open() override { rig_.open(); }
  RigReading read() noexcept override {
    const RigReading reading = rig_.read();
    last_m = scaler_.scale(reading.cart_counts, reading.pendulum_counts).cart_m;
    farthest_m = std::max(farthest_m, std::abs(last_m));
    return reading;
  }
  RigFault write(double voltage_v) noexcept override {
    pushed_out = pushed_out || (std::abs(last_m) > 0.4 && voltage_v * last_m > 0.0);
    return rig_.write(sign_ * voltage_v);
  }
  StopReport stop() noexcept override { return rig_.stop(); }

  double last_m = 0.0, farthest_m = 0.0;
  bool pushed_out = false;  ///< beyond the track limit, a voltage away from the middle

 private:
  Rig& rig_;
  double sign_;
  PoseScaler scaler_;
};

struct Ended {
  LoopOutcome outcome;
  double farthest_m = 0.0, last_m = 0.0;
  bool pushed_out = false;
};

/// A piece that begins with the cart beyond the track limit of 0.4 m.
Ended begin_beyond(const std::string& piece, double cart_m, double cart_mps, double theta_rad, double sign) {
  ExperimentSetup setup = setup_with(piece, "exponential.yaml");
  setup.rig.simulated->initial = {cart_m, theta_rad};
  setup.rig.simulated->initial_cart_mps = cart_mps;
  VirtualClock clock;
  const auto simulated = make_simulated_rig(setup.rig, setup.plant, clock, {});
  WitnessedRig rig(*simulated, sign, calibration_in_use(setup.rig));
  rig.open();
  Controller controller(setup.control, 10.0);
  ExperimentScript script(setup.experiment.pieces.front(), {setup.control.period_s(), 0.34, 10.0,
                                                            servo_model(setup.plant), setup.control.gains});
  controller.follow(&script);
  PoseScaler scaler(calibration_in_use(setup.rig));
  LoopLimits limits;
  limits.periods = 100'000;
  limits.track_limit_m = setup.rig.track_limit_m;
  limits.fall_angle_rad = setup.rig.fall_angle_rad;
  limits.watchdog_s = 1.0;
  limits.max_periods_late = 1;
  limits.coast_s = setup.rig.coast_s;
  RowMemory memory;
  const SignalFlag no_signal{0};
  LiveStatus live;
  ControlLoop loop(rig, clock, controller, scaler, memory, limits, no_signal, live);
  Ended ended;
  loop.run(ended.outcome);
  ended.farthest_m = rig.farthest_m;
  ended.last_m = rig.last_m;
  ended.pushed_out = rig.pushed_out;
  return ended;
}

const std::string balance = "{kind: closed_loop, set_points_m: [0], hold_s: 2, start: swing_up}";

TEST(TrackLimit, AScriptBringsTheCartBack) {
  for (const double lean_rad : {0.2, 0.5, 1.5, std::numbers::pi})
    for (const double side : {1.0, -1.0})
      for (const double cart_mps : {0.0, 0.8, 1.5}) {
        const Ended ended = begin_beyond(balance, side * 0.402, side * cart_mps, side * lean_rad, 1.0);
        EXPECT_EQ(ended.outcome.reason, StopReason::duration)
            << name_of(ended.outcome.reason) << " from " << lean_rad << " rad at " << side * cart_mps
            << " m/s";
        EXPECT_FALSE(ended.pushed_out);
        EXPECT_LT(std::abs(ended.last_m), 0.1);
      }
}

TEST(TrackLimit, AReversedAmplifierIsNoticedWithinCentimetres) {
  for (const double side : {1.0, -1.0}) {
    const Ended ended = begin_beyond(balance, side * 0.402, 0.0, std::numbers::pi, -1.0);
    EXPECT_EQ(ended.outcome.reason, StopReason::track_limit);
    EXPECT_LT(ended.farthest_m, 0.402 + 0.15);
    EXPECT_LT(ended.outcome.time_s, 15.0);
  }
}

TEST(TrackLimit, WhatDoesNotBringItBackEndsAtOnce) {
  for (const char* piece : {"{kind: sign_check, largest_v: 4}", "{kind: observe, duration_s: 5}",
                            "{kind: free_decay, angle_deg: 30, duration_s: 5}"}) {
    const Ended ended = begin_beyond(piece, 0.41, 0.0, std::numbers::pi, 1.0);
    EXPECT_EQ(ended.outcome.reason, StopReason::track_limit) << piece;
    EXPECT_EQ(ended.outcome.counts.periods, 1u) << piece;
  }
}

}  // namespace
}  // namespace upright
