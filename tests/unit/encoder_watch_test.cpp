#include "upright/control/encoder_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace upright {
namespace {

constexpr double period_s = 0.002;

/// Feeds periods until an encoder is found stuck; returns when, or the end.
template <class Make>
double found_after_s(EncoderWatch& watch, double until_s, StuckEncoder expected, Make make) {
  for (std::uint64_t tick = 0; static_cast<double>(tick) * period_s < until_s; ++tick) {
    WatchedPeriod period = make(tick);
    period.tick = tick;
    period.time_s = static_cast<double>(tick) * period_s;
    const StuckEncoder found = watch.step(period);
    if (found == StuckEncoder::none) continue;
    EXPECT_EQ(found, expected);
    return period.time_s;
  }
  return until_s;
}

TEST(EncoderWatch, FindsACartThatDoesNotCountUnderAStrongVoltage) {
  EncoderWatch watch;
  const double found_s = found_after_s(watch, 5.0, StuckEncoder::cart, [](std::uint64_t tick) {
    return WatchedPeriod{0, 0.0, 7, static_cast<std::int64_t>(tick), 0.0, 3.0};
  });
  EXPECT_NEAR(found_s, 0.05, 2 * period_s);
  EXPECT_EQ(watch.silent_since(StuckEncoder::cart), 1u);
}

TEST(EncoderWatch, LetsACartRestBelowItsBreakaway) {
  EncoderWatch watch;
  const double found_s = found_after_s(watch, 60.0, StuckEncoder::none,
                                       [](std::uint64_t) { return WatchedPeriod{0, 0.0, 7, 3, 0.0, 1.4}; });
  EXPECT_EQ(found_s, 60.0);
}

TEST(EncoderWatch, TakesABriefPulseOfAStrongVoltageForNoProof) {
  EncoderWatch watch;
  const double found_s = found_after_s(watch, 0.5, StuckEncoder::none, [](std::uint64_t tick) {
    return WatchedPeriod{0, 0.0, 7, 3, 0.0, tick == 10 ? 15.0 : 0.0};
  });
  EXPECT_EQ(found_s, 0.5);
}

TEST(EncoderWatch, FindsAPendulumThatDoesNotCountWhileTheCartIsShaken) {
  EncoderWatch watch;
  const double found_s = found_after_s(watch, 5.0, StuckEncoder::pendulum, [](std::uint64_t tick) {
    return WatchedPeriod{
        0, 0.0, static_cast<std::int64_t>(tick), 3, 0.5 * std::sin(0.05 * static_cast<double>(tick)), 1.0};
  });
  EXPECT_NEAR(found_s, 0.1, 2 * period_s);
}

TEST(EncoderWatch, FindsACartThatIsSilentWhileThePendulumCountsOn) {
  EncoderWatch watch;
  const double found_s = found_after_s(watch, 5.0, StuckEncoder::cart, [](std::uint64_t tick) {
    return WatchedPeriod{0, 0.0, 7, static_cast<std::int64_t>(tick / 10), 0.0, 0.3};
  });
  EXPECT_NEAR(found_s, 1.0, 2 * period_s);
}

TEST(EncoderWatch, LetsACartCreepHomeUnderAPendulumThatStaysWithinACount) {
  EncoderWatch watch;
  const double found_s = found_after_s(watch, 20.0, StuckEncoder::none, [](std::uint64_t tick) {
    return WatchedPeriod{0, 0.0, static_cast<std::int64_t>(tick / 10), 3, 0.001, 0.3};
  });
  EXPECT_EQ(found_s, 20.0);
}

TEST(EncoderWatch, LetsBothRestAndForgetsOnReset) {
  EncoderWatch watch;
  const auto rest = [](std::uint64_t) { return WatchedPeriod{0, 0.0, 7, 3, 0.0, 0.3}; };
  EXPECT_EQ(found_after_s(watch, 60.0, StuckEncoder::none, rest), 60.0);
  EncoderWatch again;
  for (std::uint64_t tick = 0; tick < 5000; ++tick) {
    if (tick % 20 == 0) again.reset();
    ASSERT_EQ(again.step({tick, static_cast<double>(tick) * period_s, 7, 3, 0.0, 10.0}), StuckEncoder::none);
  }
}

/// A cart and a pendulum that follow what the watch takes for granted: however the voltage goes, nobody is
/// stuck.
TEST(EncoderWatch, NeverAccusesEncodersThatCount) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise;
  for (int run = 0; run < 20; ++run) {
    EncoderWatch watch;
    double voltage = 0.0, velocity = 0.0, cart_m = 0.0, theta = 0.01, rate = 0.0;
    for (std::uint64_t tick = 0; tick < 20'000; ++tick) {
      constexpr double breakaway_v = 0.5, v_per_mps = 6.2, mps2_per_v = 1.58, length_m = 0.407;
      voltage = std::clamp(voltage + noise(random), -10.0, 10.0);
      const bool sticks = velocity == 0.0 && std::abs(voltage) < breakaway_v;
      const double drive = voltage - v_per_mps * velocity - std::copysign(breakaway_v, velocity);
      const double acceleration = sticks ? 0.0 : mps2_per_v * drive;
      velocity += acceleration * period_s;
      cart_m += velocity * period_s;
      rate += (9.8 * theta - acceleration) / length_m * period_s;
      theta = std::remainder(theta + rate * period_s, 6.283185307179586);
      const auto cart = static_cast<std::int64_t>(std::floor(cart_m / 2.27485e-5));
      const auto pendulum = static_cast<std::int64_t>(std::floor(theta * 651.9));
      ASSERT_EQ(watch.step({tick, static_cast<double>(tick) * period_s, cart, pendulum, velocity, voltage}),
                StuckEncoder::none)
          << run << " " << tick;
    }
  }
}

}  // namespace
}  // namespace upright
