// The detector of stalls, and what a stall excuses: a timing assertion whose interval it overlaps, and
// nothing else. A process of its own stands still, stopped by a signal, and is judged by what it prints, its
// exit code and the lines in its file of retries and skips.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "temporary_folder.hpp"
#include "tests/support/real_time.hpp"

namespace upright::test {
namespace {

constexpr double stall_s = 0.06;

void sleep_s(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += what.size()) ++count;
  return count;
}

/// What a test of stall_samples.cpp came to.
struct Sample {
  int exit_code = -1;
  std::string out, counted;
  std::vector<Interval> stops;  ///< surely it stood still so long
  std::size_t attempts() const { return count_of(out, "attempt\n"); }
};

/// Runs a sample, and lets it go on after each stop.
Sample run_sample(const std::string& test) {
  const TemporaryFolder folder;
  const std::string out = folder.path() / "out", counted = folder.path() / "counted";
  const pid_t child = fork();
  if (child == 0) {
    setenv("UPRIGHT_RETRY_LOG", counted.c_str(), 1);
    const std::string command =
        "exec '" UPRIGHT_STALL_SAMPLES "' --gtest_color=no --gtest_filter=Sample." + test + " >'" + out + "'";
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(127);
  }
  Sample sample;
  for (int status = 0; waitpid(child, &status, WUNTRACED) == child;) {
    if (!WIFSTOPPED(status)) {
      sample.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
      break;
    }
    const Since stopped;
    sleep_s(stall_s);
    sample.stops.push_back(stopped.until_now());
    kill(child, SIGCONT);
  }
  sample.out = text_of(out);
  std::error_code none;
  if (std::filesystem::exists(counted, none)) sample.counted = text_of(counted);
  return sample;
}

std::optional<Interval> printed(const std::string& text, const std::string& name) {
  const std::size_t at = text.find(name + " ");
  if (at == std::string::npos) return std::nullopt;
  Interval interval;
  std::istringstream(text.substr(at + name.size())) >> interval.begin_s >> interval.end_s;
  return interval;
}

/// Whether it found the stop and nothing else: a busy machine may take the process more time right before or
/// after. That it found the stop is asserted.
bool finds_just_the_stop() {
  const Sample sample = run_sample("PrintsTheStallItFound");
  const std::optional<Interval> found = printed(sample.out, "found"),
                                stopped = printed(sample.out, "stopped");
  EXPECT_EQ(sample.exit_code, 0) << sample.out;
  EXPECT_EQ(sample.stops.size(), 1u);
  EXPECT_TRUE(found && stopped) << sample.out;
  if (testing::Test::HasFailure()) return true;
  EXPECT_LE(found->begin_s, sample.stops.front().begin_s);
  EXPECT_GE(found->end_s, sample.stops.front().end_s);
  constexpr double tolerance_s = 3 * LateWakes::period_s;
  return found->begin_s > stopped->begin_s - tolerance_s && found->end_s < stopped->end_s + tolerance_s;
}

TEST(StallDetector, FindsWhenAProcessStoodStill) {
  constexpr int max_samples = 50;
  int samples = 1;
  while (!finds_just_the_stop() && samples < max_samples) ++samples;
  EXPECT_LT(samples, max_samples) << "none was found within a few periods of the detector";
}

/// Whether a thread that works for several times a stall's length was taken for none.
bool works_without_stall(const StallDetector& detector) {
  const Since begin;
  while (begin.until_now().end_s < begin.begin_s() + 5 * LateWakes::stall_s) {
  }
  return !detector.stall_in(begin.until_now());
}

TEST(StallDetector, DoesNotTakeABusyProcessForOne) {
  const StallDetector detector;
  constexpr int max_spells = 100;
  int spells = 1;
  for (; !works_without_stall(detector) && spells < max_spells; ++spells) sleep_s(0.1);
  EXPECT_LT(spells, max_spells) << "the machine may stall in some of them, not in all";
}

/// Wakes that are so late, one after the other; the last that was said of a stall.
std::optional<Interval> stall_of(const std::vector<double>& late_s) {
  LateWakes wakes;
  std::optional<Interval> last;
  double now_s = 1.0;
  wakes.woke(now_s);
  for (const double late : late_s) {
    now_s += LateWakes::period_s + late;
    if (const auto stall = wakes.woke(now_s)) last = stall;
  }
  return last;
}

TEST(LateWakes, AreAStallFromTenMillisecondsOn) {
  EXPECT_FALSE(stall_of({0, 0.009, 0, 0}).has_value());
  const std::optional<Interval> stall = stall_of({0, 0.030, 0, 0});
  ASSERT_TRUE(stall.has_value());
  EXPECT_NEAR(stall->begin_s, 1.001, 1e-9);
  EXPECT_NEAR(stall->end_s, 1.032, 1e-9);
}

TEST(LateWakes, InSlicesAreOneStall) {
  const std::optional<Interval> stall = stall_of({0.004, 0, 0.004, 0, 0.004, 0, 0});
  ASSERT_TRUE(stall.has_value());
  EXPECT_NEAR(stall->begin_s, 1.0, 1e-9);
  EXPECT_NEAR(stall->end_s, 1.017, 1e-9);
}

TEST(LateWakes, FarApartOrLateByLittleAreNoStall) {
  std::vector<double> late_s;
  for (int i = 0; i < 20; ++i) {
    late_s.push_back(0.006);
    late_s.insert(late_s.end(), 6, 0.0);
  }
  EXPECT_FALSE(stall_of(late_s).has_value());
  EXPECT_FALSE(stall_of(std::vector<double>(1000, 0.0009)).has_value()) << "every machine has that";
}

TEST(Interval, OverlapsWhatItTouches) {
  const Interval one{1.0, 2.0};
  EXPECT_TRUE(one.overlaps({1.5, 1.6}));
  EXPECT_TRUE(one.overlaps({0.0, 1.0}));
  EXPECT_TRUE(one.overlaps({2.0, 3.0}));
  EXPECT_FALSE(one.overlaps({0.0, 0.9}));
  EXPECT_FALSE(one.overlaps({2.1, 3.0}));
}

TEST(Stall, ThatOverlapsExcusesTimingAndAfterAllAttemptsSkips) {
  const Sample sample = run_sample("FailsOnTimingInEveryStall");
  EXPECT_EQ(sample.exit_code, 0) << sample.out;
  EXPECT_EQ(sample.attempts(), static_cast<std::size_t>(max_attempts));
  EXPECT_NE(sample.out.find("[  SKIPPED ]"), std::string::npos) << sample.out;
  EXPECT_EQ(count_of(sample.counted, "retry\tSample.FailsOnTimingInEveryStall\t"), max_attempts - 1u);
  EXPECT_EQ(count_of(sample.counted, "skip\tSample.FailsOnTimingInEveryStall\t"), 1u);
  EXPECT_EQ(count_of(sample.counted, "\n"), static_cast<std::size_t>(max_attempts));
}

TEST(Stall, ThatIsOverLetsTheNextAttemptPass) {
  const Sample sample = run_sample("FailsOnTimingInTheFirstStallOnly");
  EXPECT_EQ(sample.exit_code, 0) << sample.out;
  EXPECT_EQ(sample.attempts(), 2u);
  EXPECT_EQ(sample.out.find("[  SKIPPED ]"), std::string::npos) << sample.out;
  EXPECT_EQ(count_of(sample.counted, "retry\t"), 1u);
  EXPECT_EQ(count_of(sample.counted, "\n"), 1u);
}

/// Fails in its one attempt, with nothing to count.
void expect_plain_failure(const std::string& test) {
  const Sample sample = run_sample(test);
  EXPECT_EQ(sample.exit_code, 1) << sample.out;
  EXPECT_EQ(sample.attempts(), 1u);
  EXPECT_EQ(sample.stops.size(), 1u) << "it did stand still";
  EXPECT_EQ(sample.counted, "");
}

TEST(Stall, AtAnotherTimeExcusesNothing) {
  expect_plain_failure("FailsOnTimingAtAnotherTimeThanTheStall");
}

TEST(Stall, ExcusesNoValue) {
  expect_plain_failure("FailsOnAValueInAStall");
  expect_plain_failure("FailsOnAValueAndOnTimingInAStall");
}

TEST(Stall, ExcusesNothingOutsideOfAttempts) {
  expect_plain_failure("FailsOnTimingWithoutAnAttempt");
}

}  // namespace
}  // namespace upright::test
