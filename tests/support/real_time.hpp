// Assertions on timing, for tests that need an idle machine. If such an assertion fails while a stall of the
// machine overlaps its interval, the attempt is repeated. If every attempt meets a stall, the test is
// skipped, because timing results are meaningless on a stalled machine. No stall excuses any other assertion,
// and a test that fails in this way is not repeated. Each retry and skip is a line in a file, which
// scripts/count_retries.py counts.
#pragma once

#include <time.h>

#include <functional>
#include <string>

#include "stall_detector.hpp"

namespace upright::test {

/// The largest number of attempts. If one attempt in three meets a stall, one test in 81 is skipped.
inline constexpr int max_attempts = 4;

/// Repeats an attempt as long as a stall excuses it. False: every attempt met a stall, and the test is
/// skipped.
bool in_real_time(const std::function<void()>& attempt);

/// Asserts a condition that depends on timing. If it is false, throws out of the attempt when a stall excuses
/// it, and fails otherwise. Outside of `in_real_time` nothing is excused.
void expect_timing(const Interval& when, bool holds, const char* condition, const std::string& what,
                   const char* file, int line);

/// EXPECT_TIMING(INTERVAL, CONDITION, TEXT)
#define EXPECT_TIMING(when, condition, what) \
  ::upright::test::expect_timing((when), (condition), #condition, (what), __FILE__, __LINE__)

/// The interval from its construction until a given call.
class Since {
 public:
  Since() : begin_s_(now_s()) {}
  double begin_s() const { return begin_s_; }
  Interval until_now() const { return {begin_s_, now_s()}; }

 private:
  static double now_s() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }
  double begin_s_;
};

}  // namespace upright::test
