#include "experiment/experiment.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "commissioning/sign_check.hpp"
#include "experiment/pieces/delay_sweep.hpp"
#include "experiment/pieces/free_decay.hpp"
#include "experiment/pieces/observe.hpp"
#include "upright/base/error.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {
namespace {

namespace fs = std::filesystem;

const fs::path config = fs::path(UPRIGHT_SOURCE_DIR) / "config";

Experiment experiment_with(const std::string& piece, const std::string& extra = "") {
  return read_experiment_text(
      "experiment:\n  name: test\n  why: a test\n  travel_m: 0.3\n  voltage_limit_v: 10\n" + extra +
          "  pieces:\n    - " + piece + "\n",
      config / "experiments" / "test.yaml");
}

ExperimentSetup setup_with(const std::string& piece, const std::string& plant = "exponential.yaml") {
  ExperimentSetup setup;
  setup.experiment = experiment_with(piece, "  gains: ../gains/exponential.yaml\n");
  setup.rig = read_rig_file(config / "rigs" / "simulated.yaml");
  setup.rig.amplifier.limit_v = 10.0;
  setup.plant = read_plant_file(config / "plants" / plant);
  setup.control = read_gain_file(config / "gains" / "exponential.yaml");
  return setup;
}

TEST(ExperimentFile, EveryPieceOfTheConfigurationReadsBack) {
  int pieces = 0;
  for (const auto& entry : fs::recursive_directory_iterator(config / "experiments")) {
    if (entry.path().extension() != ".yaml") continue;
    for (const Piece& piece : read_experiment_file(entry.path()).pieces) {
      const std::string text = piece_text(piece);
      const Piece again = read_piece(YamlMap::from_text("piece: " + text, "text").map("piece"));
      EXPECT_EQ(piece_text(again), text);
      if (const auto* decay = piece.as<pieces::FreeDecay>()) {
        EXPECT_EQ(again.as<pieces::FreeDecay>()->angle_rad(), decay->angle_rad());
      }
      if (const auto* balancing = piece.as<pieces::Balancing>()) {
        EXPECT_EQ(again.as<pieces::Balancing>()->theta0_rad, balancing->theta0_rad);
      }
      ++pieces;
    }
  }
  EXPECT_GE(pieces, 15);
}

TEST(ExperimentFile, RefusesWhatCannotBeMeantAndSaysWhatToDo) {
  for (const char* piece :
       {"{kind: rampe, rate_v_per_s: 1}", "{kind: ramp}", "{kind: ramp, rate_v_per_s: -1}",
        "{kind: constant_voltage, voltages_v: []}", "{kind: constant_voltage, voltages_v: [11]}",
        "{kind: multisine, amplitude_v: 1, lowest_hz: 2, highest_hz: 1, duration_s: 1}",
        "{kind: closed_loop, set_points_m: [0], hold_s: 1}", "{kind: observe, duration_s: 1, colour: red}",
        "{kind: observe, duration_s: 1, turned: true}", "{kind: ramp, rate_v_per_s: .nan}",
        "{kind: ramp, rate_v_per_s: 1e-9}",
        "{kind: slow_sine, amplitude_m: 0.1, period_s: 1e-9, duration_s: 1}",
        "{kind: delay_sweep, delay_s: [0, 0.01], duration_s: 1, bisect_to_s: 1e-300}",
        "{kind: delay_sweep, delay_s: {from: 0, to: 1, count: 1000}, duration_s: 3600, repeats: 100}",
        "{kind: constant_voltage, voltages_v: [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 1, 2, 3, 4, 5, 6, 7, 8, 9], "
        "repeats: "
        "100}"}) {
    try {
      experiment_with(piece);
      ADD_FAILURE() << piece;
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find("test.yaml:"), std::string::npos) << error.what();
    }
  }
}

TEST(ExperimentScript, ARampFindsTheBreakawayVoltageOfThePlant) {
  ExperimentSetup setup = setup_with("{kind: ramp, rate_v_per_s: 0.1, repeats: 2}");
  setup.plant.pendulum.reset();
  const Rehearsal r = rehearse(setup.experiment.pieces.front(), setup);
  ASSERT_EQ(r.outcome.reason, StopReason::duration);
  // (4): 0.0861 (M + m) g of force.
  const double breakaway_v = (0.4306291 + 0.4342453) / 1.7189;
  int ramps = 0, rising = 0;
  double from_m = 0.0, went_v = 0.0;
  for (std::size_t k = 1; k < r.rows.size(); ++k) {
    const double v = std::abs(r.rows[k].voltage_v), before = std::abs(r.rows[k - 1].voltage_v);
    // 0.1 V/s at 1 kHz.
    if (std::abs(v - before - 1e-4) < 1e-9) {
      if (rising++ == 0) {
        from_m = r.rows[k].cart_m;
        went_v = 0.0;
      }
      if (went_v == 0.0 && std::abs(r.rows[k].cart_m - from_m) > 4e-5) went_v = v;
      continue;
    }
    if (rising > 1000) {
      ++ramps;
      EXPECT_NEAR(went_v, breakaway_v, 0.03 * breakaway_v);
    }
    rising = 0;
  }
  EXPECT_EQ(ramps, 4);
}

TEST(ExperimentScript, AConstantVoltageReachesTerminalVelocity) {
  ExperimentSetup setup = setup_with("{kind: constant_voltage, voltages_v: [3]}", "viscous.yaml");
  setup.plant.pendulum.reset();
  const Rehearsal r = rehearse(setup.experiment.pieces.front(), setup);
  ASSERT_EQ(r.outcome.reason, StopReason::duration);
  const double terminal_mps = 1.7189 * 3.0 / (7.682 + 3.0);
  double fastest = 0.0, slowest = 0.0;
  for (const LogRecord& row : r.rows) {
    fastest = std::max(fastest, row.cart_velocity_mps);
    slowest = std::min(slowest, row.cart_velocity_mps);
  }
  EXPECT_NEAR(fastest, terminal_mps, 0.02 * terminal_mps);
  EXPECT_NEAR(-slowest, terminal_mps, 0.02 * terminal_mps);
}

TEST(ExperimentPlan, RefusesATravelTooSmallForThePlannedVoltage) {
  ExperimentSetup setup = setup_with("{kind: constant_voltage, voltages_v: [4]}");
  EXPECT_NO_THROW(plan_pieces(setup));
  setup.experiment.travel_m = 0.1;
  try {
    plan_pieces(setup);
    ADD_FAILURE();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find(": lower the voltage to"), std::string::npos) << error.what();
  }
}

TEST(ExperimentPlan, LowersTheVoltageOnlyWhereItMay) {
  const std::string piece = "{kind: square_wave, amplitude_v: 9, period_s: 2, duration_s: 4";
  EXPECT_THROW(plan_pieces(setup_with(piece + "}")), ConfigError);
  const std::vector<Piece> fitted = plan_pieces(setup_with(piece + ", fit_to_travel: true}"));
  const double amplitude_v = amplitude_of(*fitted.front().kind).voltage_v;
  EXPECT_LT(amplitude_v, 9.0);
  EXPECT_GT(amplitude_v, 0.5);
}

Piece sweep_piece(double stable_below_rad = 0.0) {
  pieces::DelaySweep sweep;
  sweep.delays_s = {0.0, 0.008, 0.016, 0.024, 0.032};
  sweep.bisect_to_s = 0.001;
  sweep.repeats = 2;
  sweep.stable_below_rad = stable_below_rad;
  return Piece{sweep};
}

TEST(DelaySweep, OrdersDelaysSoThatFallsComeLate) {
  const std::vector<Piece> pieces = {sweep_piece()};
  const double oscillates_s[2] = {0.0103, 0.0121}, falls_s[2] = {0.0217, 0.0233};
  std::vector<TrialResult> done;
  bool fell_while_listed = false;
  while (const auto trial = next_trial(pieces, done)) {
    TrialResult r;
    r.trial = *trial;
    const double d = trial->delay_s;
    r.outcome = d >= falls_s[trial->repeat]        ? "fell"
                : d >= oscillates_s[trial->repeat] ? "oscillating"
                                                   : "stable";
    done.push_back(r);
    ASSERT_LT(done.size(), 100u);
  }
  // Nothing longer than the first delay of the list under which it fell was tried.
  for (const TrialResult& r : done) fell_while_listed = fell_while_listed || r.trial.delay_s > 0.0241;
  EXPECT_FALSE(fell_while_listed);
  for (int repeat = 0; repeat < 2; ++repeat)
    for (const auto& [from, truth] : {std::pair{1, oscillates_s[repeat]}, std::pair{2, falls_s[repeat]}}) {
      double below = 0.0, above = 1.0;
      for (const TrialResult& r : done) {
        if (r.trial.repeat != repeat) continue;
        const int severity = r.outcome == "fell" ? 2 : r.outcome == "oscillating" ? 1 : 0;
        if (severity < from)
          below = std::max(below, r.trial.delay_s);
        else
          above = std::min(above, r.trial.delay_s);
      }
      EXPECT_LE(below, truth);
      EXPECT_GE(above, truth);
      EXPECT_LE(above - below, 0.001 + 1e-9);
    }
}

/// A run that balances: the angle swings with an amplitude and a frequency, read by an encoder of 4096
/// counts.
std::vector<LogRecord> swinging(double amplitude_rad, double frequency_hz) {
  constexpr double step_rad = 2.0 * std::numbers::pi / 4096.0;
  std::vector<LogRecord> rows(30'000);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    LogRecord& row = rows[k];
    row.tick = k;
    row.time_ns = static_cast<std::int64_t>(k) * 1'000'000;
    const double angle = 0.01 + amplitude_rad * std::sin(2.0 * std::numbers::pi * frequency_hz * 1e-3 *
                                                         static_cast<double>(k));
    row.theta_rad = step_rad * std::round(angle / step_rad);
    row.flags = row_flag::feedback;
  }
  return rows;
}

TEST(DelaySweep, MeasuresAmplitudeAndFrequencyOfAnOscillation) {
  const Piece piece = sweep_piece(0.0061);
  for (const double frequency_hz : {0.4, 1.63, 4.0}) {
    const TrialResult r = judge_trial({}, piece, swinging(0.05, frequency_hz), StopReason::duration);
    EXPECT_EQ(r.outcome, "oscillating");
    EXPECT_NEAR(r.theta_amplitude_rad, 0.05, 0.0016);
    EXPECT_NEAR(r.frequency_hz, frequency_hz, 0.01 * frequency_hz);
  }
  EXPECT_TRUE(std::isnan(judge_trial({}, piece, swinging(0.003, 2.0), StopReason::duration).frequency_hz));
  EXPECT_TRUE(std::isnan(judge_trial({}, piece, swinging(0.05, 2.0), StopReason::fell).frequency_hz));
}

TEST(DelaySweep, ARunThatNeverBalancedIsNoResult) {
  const Piece piece = sweep_piece();
  std::vector<LogRecord> rows = swinging(0.003, 2.0);
  for (LogRecord& row : rows) row.flags = 0;
  for (const StopReason reason : {StopReason::duration, StopReason::track_limit, StopReason::fell}) {
    EXPECT_EQ(judge_trial({}, piece, rows, reason).outcome, "");
    EXPECT_EQ(judge_trial({}, piece, {}, reason).outcome, "");
  }
  // Nor is one that ended with the first period of balance.
  rows.front().flags = row_flag::feedback;
  EXPECT_EQ(judge_trial({}, piece, rows, StopReason::track_limit).outcome, "");
  // Nor one that something else ended.
  EXPECT_EQ(judge_trial({}, piece, swinging(0.003, 2.0), StopReason::signal).outcome, "");
  const Piece observe{pieces::Observe{}};
  EXPECT_EQ(judge_trial({}, observe, rows, StopReason::duration).outcome, "done");
  EXPECT_EQ(judge_trial({}, observe, rows, StopReason::track_limit).outcome, "");
}

TEST(DelaySweep, IsNotCompleteWithoutAFallInEachRepeat) {
  const std::vector<Piece> pieces = {sweep_piece()};
  std::vector<TrialResult> done;
  while (const auto trial = next_trial(pieces, done)) {
    TrialResult r;
    r.trial = *trial;
    r.outcome = trial->repeat == 0 && trial->delay_s > 0.03 ? "fell" : "stable";
    done.push_back(r);
  }
  const std::string missing = missing_transitions(pieces, done);
  EXPECT_NE(missing.find("in repeat 2 the pendulum did not fall up to 32"), std::string::npos) << missing;
  for (TrialResult& r : done)
    if (r.trial.delay_s > 0.03) r.outcome = "fell";
  EXPECT_EQ(missing_transitions(pieces, done), "");
}

TEST(SignCheck, PulsesUpToItsLargestVoltageHoweverLow) {
  for (const double largest_v : {1e-9, 0.3, 0.5, 1.0, 1.2, 4.0}) {
    ExperimentSetup setup = setup_with("{kind: sign_check, largest_v: " + exact_text(largest_v) + "}");
    setup.plant.set(effect_number("coulomb_friction"), std::vector<double>{5.0});  // nothing moves
    double max_v = 0.0;
    for (const LogRecord& row : rehearse(setup.experiment.pieces.front(), setup).rows)
      max_v = std::max(max_v, std::abs(row.voltage_v));
    EXPECT_EQ(max_v, largest_v);
  }
}

TEST(SignCheck, FindsEveryWrongSign) {
  ExperimentSetup setup = setup_with("{kind: sign_check, largest_v: 4}");
  const std::vector<LogRecord> rows = rehearse(setup.experiment.pieces.front(), setup).rows;
  EXPECT_TRUE(judge_signs(rows, true).agrees) << judge_signs(rows, true).sentence;
  const auto with = [&](double cart, double pendulum) {
    std::vector<LogRecord> changed = rows;
    for (LogRecord& row : changed) {
      row.cart_m *= cart;
      row.theta_rad *= pendulum;
    }
    return judge_signs(changed, true);
  };
  EXPECT_NE(with(-1, -1).sentence.find("amplifier.sign"), std::string::npos);
  EXPECT_NE(with(-1, 1).sentence.find("amplifier.sign"), std::string::npos);
  EXPECT_NE(with(1, -1).sentence.find("calibration.pendulum.sign"), std::string::npos);
  EXPECT_FALSE(with(0, 1).agrees);
  EXPECT_FALSE(with(1, 0).agrees);
}

}  // namespace
}  // namespace upright
