// Which cycle a device's sample belongs to, and what is known of the device's clock.
#include "runtime/device_clock.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <vector>

namespace upright {
namespace {

constexpr std::int64_t period_ns = 1'000'000;

/// When each sample arrives. Those at 0 are lost.
using Arrivals = std::vector<std::int64_t>;

Arrivals arrivals(int count, double ppm, const std::function<std::int64_t(int)>& delay_ns) {
  Arrivals times;
  for (int i = 0; i < count; ++i) {
    const std::int64_t delay = delay_ns(i);
    const double taken_ns =
        1e9 + static_cast<double>(i) * (1.0 + 1e-6 * ppm) * static_cast<double>(period_ns);
    times.push_back(delay < 0 ? 0 : static_cast<std::int64_t>(taken_ns) + delay);
  }
  return times;
}

struct Followed {
  std::vector<Wake> fresh;         ///< cycles that had their sample
  std::vector<std::int64_t> when;  ///< it came
  int empty = 0;                   ///< cycles that had none
  int passed_over = 0;             ///< samples of cycles that had run without them
  DeviceTiming timing;
};

/// A loop that takes no time, on these samples.
Followed follow(const Arrivals& times) {
  Followed followed;
  LoopPhase phase{0, period_ns, 0};
  DeviceClock clock;
  DeviceSample sample;
  for (const std::int64_t time_ns : times) {
    if (time_ns == 0) continue;
    if (sample.number > 0)
      for (; time_ns >= DeviceClock::patience_ends_ns(phase); ++followed.empty)
        wake_at(phase, DeviceClock::patience_ends_ns(phase));
    sample = {sample.number + 1, time_ns};
    if (!clock.take(sample, phase)) {
      ++followed.passed_over;
      continue;
    }
    followed.fresh.push_back(clock.wake(phase, time_ns));
    followed.when.push_back(time_ns);
  }
  followed.timing = clock.timing(period_ns);
  return followed;
}

TEST(DeviceClock, FollowsADriftWithoutMissingACycle) {
  for (const double ppm : {500.0, -500.0, 15'000.0, -15'000.0}) {
    const Followed followed = follow(arrivals(10'000, ppm, [](int) { return 0; }));
    ASSERT_EQ(followed.fresh.size(), 10'000u) << ppm;
    EXPECT_EQ(followed.fresh.back().tick, 9'999u);
    EXPECT_NEAR(followed.timing.drift_ppm, ppm, 0.01);
    EXPECT_NEAR(followed.timing.period_s, 1e-3 * (1.0 + 1e-6 * ppm), 1e-11);
    EXPECT_EQ(followed.timing.lost, 0u);
    EXPECT_EQ(followed.empty, 0);
  }
}

TEST(DeviceClock, ACycleWithoutItsSampleIsLostAndKeepsItsNumber) {
  const Followed followed = follow(arrivals(10'000, 500.0, [](int i) { return i % 20 == 7 ? -1 : 0; }));
  EXPECT_EQ(followed.empty, 500);
  EXPECT_EQ(followed.timing.lost, 500u);
  EXPECT_EQ(followed.timing.samples, 9'500u);
  EXPECT_EQ(followed.fresh.back().tick, 9'999u);
  for (const Wake& wake : followed.fresh) EXPECT_NE(wake.tick % 20, 7u);
  EXPECT_NEAR(followed.timing.drift_ppm, 500.0, 0.1);
}

TEST(DeviceClock, DelaysOnTheWayAreNoLoss) {
  std::mt19937_64 random(5);
  std::uniform_int_distribution<std::int64_t> delay(0, period_ns / 5);
  const Followed followed = follow(
      arrivals(10'000, -300.0, [&](int i) { return i % 50 == 49 ? 6 * period_ns / 10 : delay(random); }));
  EXPECT_EQ(followed.fresh.size(), 10'000u);
  EXPECT_EQ(followed.timing.lost, 0u);
  EXPECT_EQ(followed.empty + followed.passed_over, 0);
  EXPECT_NEAR(followed.timing.drift_ppm, -300.0, 15.0) << "the last one came 0.6 ms late, of 10 s";
}

TEST(DeviceClock, AFirstSampleThatComesLateCostsOneCycle) {
  const Followed followed =
      follow(arrivals(1'000, 0.0, [](int i) { return i == 0 ? 6 * period_ns / 10 : 0; }));
  EXPECT_EQ(followed.passed_over, 1);
  EXPECT_EQ(followed.fresh.size(), 999u);
  EXPECT_EQ(followed.empty, 0);
  EXPECT_LT(followed.fresh.back().late_ns, period_ns / 1000) << "the phase is where the samples come";
}

TEST(DeviceClock, ASampleThatComesAfterItsCycleIsPassedOver) {
  const Followed followed =
      follow(arrivals(100, 0.0, [](int i) { return i == 50 ? 8 * period_ns / 10 : 0; }));
  EXPECT_EQ(followed.empty, 1);
  EXPECT_EQ(followed.fresh.back().tick, 99u);
  EXPECT_EQ(followed.timing.lost, 0u);
}

TEST(DeviceClock, PeriodsSleptThroughAreMissedAsWithATimer) {
  LoopPhase phase{0, period_ns, 0};
  DeviceClock clock;
  ASSERT_TRUE(clock.take({1, 5'000'000}, phase));
  EXPECT_EQ(clock.wake(phase, 5'000'000).tick, 0u);
  // Samples 2 to 5 came meanwhile; the loop is back 0.4 periods after the latest.
  ASSERT_TRUE(clock.take({5, 9'000'000}, phase));
  const Wake wake = clock.wake(phase, 9'400'000);
  EXPECT_EQ(wake.tick, 4u);
  EXPECT_EQ(wake.missed, 3u);
  EXPECT_EQ(wake.late_ns, 3'400'000);
  EXPECT_EQ(clock.timing(period_ns).lost, 0u) << "they arrived";
}

TEST(DeviceClock, KnowsNothingBeforeItsSecondSample) {
  LoopPhase phase{0, period_ns, 0};
  DeviceClock clock;
  EXPECT_EQ(clock.timing(period_ns).samples, 0u);
  clock.take({7, 5'000'000}, phase);
  EXPECT_EQ(clock.timing(period_ns).samples, 1u);
  EXPECT_EQ(clock.timing(period_ns).drift_ppm, 0.0);
}

}  // namespace
}  // namespace upright
