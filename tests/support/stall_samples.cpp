// Tests that cause a stall and fail, for stall_detection_test.cpp: this process stops itself, and its parent
// continues it. Not in ctest.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "real_time.hpp"

namespace upright::test {
namespace {

/// Stops this process and its detector until it is continued. Returns the interval.
Interval stalled() {
  const Since begin;
  kill(getpid(), SIGSTOP);
  return begin.until_now();
}

/// Long before this process started.
constexpr Interval another_time{0.001, 0.002};

TEST(Sample, PrintsTheStallItFound) {
  const StallDetector detector;
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const Interval stopped = stalled();
  const std::optional<Interval> found = detector.stall_in(stopped);
  ASSERT_TRUE(found.has_value());
  std::printf("stopped %.6f %.6f\nfound %.6f %.6f\n", stopped.begin_s, stopped.end_s, found->begin_s,
              found->end_s);
}

TEST(Sample, FailsOnTimingInEveryStall) {
  in_real_time([] {
    std::puts("attempt");
    EXPECT_TIMING(stalled(), false, "a timing");
    ADD_FAILURE() << "the attempt continued after an excused failure";
  });
}

TEST(Sample, FailsOnTimingInTheFirstStallOnly) {
  int attempts = 0;
  in_real_time([&] {
    std::puts("attempt");
    EXPECT_TIMING(stalled(), ++attempts > 1, "a timing");
  });
}

TEST(Sample, FailsOnTimingAtAnotherTimeThanTheStall) {
  in_real_time([] {
    std::puts("attempt");
    stalled();
    EXPECT_TIMING(another_time, false, "a timing");
  });
}

TEST(Sample, FailsOnAValueInAStall) {
  in_real_time([] {
    std::puts("attempt");
    stalled();
    EXPECT_EQ(1, 2);
  });
}

TEST(Sample, FailsOnAValueAndOnTimingInAStall) {
  in_real_time([] {
    std::puts("attempt");
    EXPECT_EQ(1, 2);
    EXPECT_TIMING(stalled(), false, "a timing");
  });
}

TEST(Sample, FailsOnTimingWithoutAnAttempt) {
  std::puts("attempt");
  EXPECT_TIMING(stalled(), false, "a timing");
}

}  // namespace
}  // namespace upright::test
