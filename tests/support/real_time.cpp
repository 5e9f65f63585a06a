#include "real_time.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <thread>

namespace upright::test {

namespace {

/// A failed timing condition and the stall that excuses it.
struct Excused {
  std::string what;
  Interval stall;
};

bool attempting = false;

StallDetector& detector() {
  static StallDetector one;
  return one;
}

std::string test_name() {
  const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
  return std::string(info->test_suite_name()) + "." + info->name();
}

std::string words_of(const Interval& stall) {
  std::ostringstream words;
  words.precision(1);
  words << std::fixed << 1e3 * (stall.end_s - stall.begin_s) << " ms";
  return words.str();
}

/// Writes a line with tabs: retry or skip, test, the failed condition, the begin and end of the stall.
void count(const char* kind, const Excused& excused) {
  const char* named = std::getenv("UPRIGHT_RETRY_LOG");
  std::string what = excused.what;
  for (char& c : what)
    if (c == '\n' || c == '\t') c = ' ';
  std::ostringstream line;
  line.precision(3);
  line << std::fixed << kind << '\t' << test_name() << '\t' << what << '\t' << excused.stall.begin_s << '\t'
       << excused.stall.end_s << '\n';
  const std::string text = line.str();
  const int file =
      ::open(named != nullptr ? named : UPRIGHT_RETRY_LOG, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  // A single write, because tests run in parallel.
  if (file < 0 || ::write(file, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    ADD_FAILURE() << "a " << kind << " could not be recorded: make the file in UPRIGHT_RETRY_LOG writable";
  if (file >= 0) ::close(file);
}

/// Waits until half a second has passed without a stall, because stalls come in groups.
void await_no_stall() {
  constexpr auto quiet = std::chrono::milliseconds(500);
  constexpr int max_waits = 20;
  for (int i = 0; i < max_waits; ++i) {
    const Since begin;
    std::this_thread::sleep_for(quiet);
    if (!detector().stall_in(begin.until_now())) return;
  }
}

/// The stall that excuses the failed attempt, if there is one.
std::optional<Excused> attempted(const std::function<void()>& attempt) {
  std::optional<Excused> excused;
  attempting = true;
  try {
    attempt();
  } catch (const Excused& thrown) {
    excused = thrown;
  } catch (...) {
    attempting = false;
    throw;
  }
  attempting = false;
  return excused;
}

}  // namespace

bool in_real_time(const std::function<void()>& attempt) {
  detector();
  for (int made = 1;; ++made) {
    const std::optional<Excused> excused = attempted(attempt);
    if (!excused || testing::Test::HasFailure()) return true;
    std::printf("!! attempt %d met a stall of the machine of %s: %s\n", made,
                words_of(excused->stall).c_str(), excused->what.c_str());
    if (made == max_attempts) {
      count("skip", *excused);
      [] {
        GTEST_SKIP() << "every attempt met a stall of this machine, so timing results are meaningless: "
                        "repeat the test on an idle "
                        "machine";
      }();
      return false;
    }
    count("retry", *excused);
    await_no_stall();
  }
}

void expect_timing(const Interval& when, bool holds, const char* condition, const std::string& what,
                   const char* file, int line) {
  if (holds) return;
  const std::optional<Interval> stall = attempting ? detector().stall_in(when) : std::nullopt;
  if (stall) throw Excused{what, *stall};
  ADD_FAILURE_AT(file, line) << what << ": " << condition
                             << " is false, and no stall of the machine occurred in these " << words_of(when);
}

}  // namespace upright::test
