// Assertions on timing, for tests that need a machine that lets them run. Such an assertion that fails is
// excused by a stall that overlaps its interval; then the attempt is made again, and when no attempt is
// without an excuse, the test is skipped. Every other assertion means what it says: nothing excuses it, and
// what has failed by it is not tried again. Each retry and skip is a line in a file, which
// scripts/count_retries.py counts.
#pragma once

#include <time.h>

#include <functional>
#include <string>

#include "stall_detector.hpp"

namespace upright::test {

/// How often an attempt is made at most: where a stall excuses one attempt in three, one test in 81 is
/// skipped.
inline constexpr int most_attempts = 4;

/// Makes an attempt, again while a stall excuses it. False: a stall excused each, and the test is skipped.
bool in_real_time(const std::function<void()>& attempt);

/// Asserts what depends on timing. Where it does not hold: throws out of the attempt when a stall excuses
/// it, and is a failure otherwise. Outside of `in_real_time` nothing is excused.
void expect_timing(const Interval& when, bool holds, const char* condition, const std::string& what,
                   const char* file, int line);

/// EXPECT_TIMING(INTERVAL, CONDITION, TEXT)
#define EXPECT_TIMING(when, condition, what) \
  ::upright::test::expect_timing((when), (condition), #condition, (what), __FILE__, __LINE__)

/// The interval from now on until it is asked for.
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
