// What `upright compare` computes, on signals whose answers are known in closed form.
#include "comparison/run_behaviour.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "report/compare_report.hpp"

namespace upright {
namespace {

constexpr double pi = std::numbers::pi;

LogRecord row_at(double time_s) {
  LogRecord row;
  row.time_ns = static_cast<std::int64_t>(std::llround(1e9 * time_s));
  return row;
}

/// A hunting loop: whole periods of 1 Hz in the window from 10 to 20 s, voltage of 2 V amplitude at 5 Hz.
RunBehaviour hunting(double rate_hz, double cart_m, double voltage_v, double noise_v = 0.0) {
  BehaviourMeter meter(10.0, 20.0);
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 1.0);
  for (int i = 0; i < static_cast<int>(20.0 * rate_hz); ++i) {
    const double t = i / rate_hz;
    LogRecord row = row_at(t);
    row.cart_m = t < 10.0 ? 1.0 : cart_m * std::sin(2.0 * pi * t);
    row.theta_rad = t < 10.0 ? 1.0 : 0.5 * cart_m * std::cos(2.0 * pi * t);
    row.voltage_v = voltage_v * std::sin(10.0 * pi * t) + (noise_v > 0.0 ? noise_v * noise(random) : 0.0);
    row.wake_late_ns = 20'000;
    meter.add(row);
  }
  RunBehaviour run;
  run.result = "completed";
  run.sample_rate_hz = rate_hz;
  run.rows = meter.rows();
  run.behaviour = meter.result();
  return run;
}

TEST(BehaviourMeter, MeasuresASineAtAnySampleRate) {
  for (const double rate_hz : {200.0, 1000.0}) {
    const RunBehaviour run = hunting(rate_hz, 1e-3, 2.0);
    ASSERT_TRUE(run.behaviour);
    EXPECT_EQ(run.rows, static_cast<std::uint64_t>(10.0 * rate_hz)) << "the window only";
    const auto& values = run.behaviour->values;
    EXPECT_NEAR(values[0].value, 2e-3, 1e-8);
    EXPECT_NEAR(values[1].value, 1e-3, 1e-8);
    EXPECT_NEAR(values[2].value, std::sqrt(2.0), 1e-9);
    // A sine's steps: the chord 2 A sin(w h / 2), of which the root mean square is 1 / sqrt(2).
    EXPECT_NEAR(values[3].value, std::sqrt(2.0) * 2.0 * std::sin(5.0 * pi / rate_hz), 1e-9);
    for (const Estimate& estimate : values) {
      ASSERT_TRUE(estimate.ci95);
      EXPECT_LE((*estimate.ci95)[0], estimate.value);
      EXPECT_GE((*estimate.ci95)[1], estimate.value);
      EXPECT_LT((*estimate.ci95)[1] - (*estimate.ci95)[0], 1e-2 * estimate.value)
          << "each batch is like the others";
    }
  }
}

TEST(BehaviourMeter, IntervalsHoldTheTruthOfNoise) {
  int missed_rms = 0, missed_step = 0;
  constexpr int trials = 200;
  for (int trial = 0; trial < trials; ++trial) {
    BehaviourMeter meter(0.0, 10.0);
    std::mt19937 random(static_cast<unsigned>(trial + 1));
    std::normal_distribution<double> noise(0.0, 1.5);
    for (int i = 0; i < 2000; ++i) {
      LogRecord row = row_at(0.005 * i);
      row.voltage_v = noise(random);
      meter.add(row);
    }
    const auto behaviour = meter.result();
    ASSERT_TRUE(behaviour);
    const auto outside = [](const Estimate& e, double truth) {
      return (*e.ci95)[0] > truth || (*e.ci95)[1] < truth ? 1 : 0;
    };
    missed_rms += outside(behaviour->values[2], 1.5);
    missed_step += outside(behaviour->values[3], 1.5 * std::sqrt(2.0));
  }
  // 95 percent: 10 of 200, with a standard deviation of 3.
  EXPECT_LE(missed_rms, 20);
  EXPECT_LE(missed_step, 20);
}

TEST(BehaviourMeter, SaysNothingOfTooLittle) {
  BehaviourMeter brief(0.0, 0.9);
  for (int i = 0; i < 900; ++i) brief.add(row_at(1e-3 * i));
  EXPECT_FALSE(brief.result());
  BehaviourMeter sparse(0.0, 10.0);
  for (int i = 0; i < 10; ++i) sparse.add(row_at(i));
  EXPECT_FALSE(sparse.result());
  BehaviourMeter without_interval(0.0, 3.0);
  for (int i = 0; i < 3000; ++i) without_interval.add(row_at(1e-3 * i));
  ASSERT_TRUE(without_interval.result());
  EXPECT_FALSE(without_interval.result()->values[2].ci95);
}

TEST(Differences, NameTheClearAndLargestFirst) {
  const RunBehaviour before = hunting(1000.0, 2e-3, 2.93 * std::sqrt(2.0), 0.05);
  const RunBehaviour after = hunting(1000.0, 1e-3, 0.74 * std::sqrt(2.0), 0.05);
  const std::vector<Difference> differences = differences_between(before, after);
  ASSERT_EQ(differences.size(), 4u);
  EXPECT_EQ(quantities[differences.front().quantity].key, "voltage_rms_v");
  EXPECT_EQ(difference_text(differences.front()), "voltage 2.93 V rms -> 0.742 V rms");
  EXPECT_TRUE(differences.front().is_clear.value());
  for (const Difference& d : differences_between(before, before)) EXPECT_FALSE(d.is_clear.value());
  EXPECT_EQ(comparison_sentences({before, after}).front(), "run B: voltage 2.93 V rms -> 0.742 V rms");
}

TEST(Differences, OfAFallAreTheFall) {
  RunBehaviour fallen = hunting(1000.0, 1.0, 10.0);
  fallen.result = "fell";
  fallen.fell = true;
  fallen.ended_s = 3.21;
  const std::vector<std::string> sentences = comparison_sentences({hunting(1000.0, 1e-3, 1.0), fallen});
  ASSERT_EQ(sentences.size(), 1u);
  EXPECT_EQ(sentences.front(), "run B: fell after 3.21 s");
}

}  // namespace
}  // namespace upright
