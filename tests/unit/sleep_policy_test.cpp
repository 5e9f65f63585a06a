// When the next cycle is due, and how it is waited for.
#include "runtime/sleep_policy.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace upright {
namespace {

TEST(SleepPolicy, KeepsThePhaseAndRunsALateCycleOnce) {
  LoopPhase phase{1000, 100, 0};
  Wake wake = wake_at(phase, 1000);
  EXPECT_EQ(wake.tick, 0u);
  EXPECT_EQ(wake.late_ns, 0);
  wake = wake_at(phase, 1130);  // late within its own period
  EXPECT_EQ(wake.tick, 1u);
  EXPECT_EQ(wake.missed, 0u);
  EXPECT_EQ(wake.late_ns, 30);
  wake = wake_at(phase, 1555);  // cycles 2, 3 and 4 are overtaken
  EXPECT_EQ(wake.tick, 5u);
  EXPECT_EQ(wake.missed, 3u);
  EXPECT_EQ(wake.late_ns, 355);
  EXPECT_EQ(phase.due_ns(phase.next_tick), 1600);
}

TEST(SleepPolicy, NeverRunsATickTwiceNorMovesThePhase) {
  std::mt19937_64 random(3);
  std::uniform_int_distribution<std::int64_t> pause(0, 450);
  LoopPhase phase{500, 100, 0};
  std::int64_t now = 500;
  std::uint64_t cycles = 0, missed = 0, last = 0;
  for (int i = 0; i < 10000; ++i) {
    now = std::max(now, phase.due_ns(phase.next_tick));
    const Wake wake = wake_at(phase, now);
    if (i > 0) {
      ASSERT_GT(wake.tick, last);
    }
    last = wake.tick;
    ++cycles;
    missed += wake.missed;
    ASSERT_EQ(cycles + missed, wake.tick + 1);
    ASSERT_LE(phase.due_ns(wake.tick), now);
    ASSERT_GT(phase.due_ns(phase.next_tick), now);
    now += pause(random);
  }
}

/// Wakes late from every sleep, and needs some time to be looked at.
class LateClock final : public Clock {
 public:
  std::int64_t now_ns() noexcept override { return now_ns_ += look_ns; }
  void sleep_until(std::int64_t time_ns) noexcept override {
    asked_for_ns = time_ns;
    now_ns_ = interrupted ? time_ns / 2 : std::max(now_ns_, time_ns + late_ns);
  }
  bool is_virtual() const noexcept override { return false; }

  static constexpr std::int64_t look_ns = 1, late_ns = 40;
  std::int64_t asked_for_ns = 0;
  bool interrupted = false;

 private:
  std::int64_t now_ns_ = 0;
};

TEST(SleepPolicy, ASpinHidesHowLateTheThreadIsWoken) {
  LateClock clock;
  const auto goes_on = [] { return false; };
  EXPECT_GT(wait_until_due(clock, 1000, 0, goes_on), 1000 + LateClock::late_ns);
  EXPECT_EQ(wait_until_due(clock, 2000, 100, goes_on), 2000);
  EXPECT_EQ(clock.asked_for_ns, 1900);
  EXPECT_GT(wait_until_due(clock, 3000, 10, goes_on), 3000) << "a spin shorter than the lateness is no help";
}

TEST(SleepPolicy, ASignalEndsTheSleepAndTheSpin) {
  LateClock clock;
  EXPECT_LT(wait_until_due(clock, 2000, 100, [] { return true; }), 2000);
  clock.interrupted = true;
  EXPECT_LT(wait_until_due(clock, 4000, 100, [] { return false; }), 3900) << "the loop sleeps again";
}

}  // namespace
}  // namespace upright
