// The line that a command shows while it works, on a terminal.
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include "cli/progress.hpp"

namespace upright::cli {
namespace {

/// What the terminal of a process shows after it reported this.
std::string shown_after(const std::function<void(Progress&)>& reports) {
  int terminal = -1;
  const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
  if (child == 0) {
    Progress progress("search");
    reports(progress);
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));  // nothing is shown in the first second
    _exit(0);
  }
  std::string seen;
  std::array<char, 4096> part{};
  for (ssize_t count; (count = read(terminal, part.data(), part.size())) > 0;)
    seen.append(part.data(), static_cast<std::size_t>(count));
  waitpid(child, nullptr, 0);
  close(terminal);
  return seen;
}

TEST(ProgressLine, EstimatesTheTimeThatIsLeft) {
  const std::string shown = shown_after([](Progress& progress) {
    progress.report_search(0.2, "first round");
    progress.report_search(0.5, "second round");
    progress.report_search(0.4, "a round of its own");
  });
  EXPECT_NE(shown.find("50 %, a round of its own, "), std::string::npos) << shown;
  EXPECT_NE(shown.find(" left, "), std::string::npos) << shown;
}

// A sweep may find that it needs more runs.
TEST(ProgressLine, KeepsTheShareOfWorkThatGrows) {
  const std::string shown = shown_after([](Progress& progress) {
    progress.report(10, 100, "runs");
    progress.report(95, 100, "runs");
    progress.report(96, 105, "runs");
  });
  EXPECT_NE(shown.find("95 %, 96 of 105 runs, "), std::string::npos) << shown;
  EXPECT_NE(shown.find(" left, "), std::string::npos) << shown;
}

TEST(ProgressLine, HasNoEstimateOfWorkThatBeginsAgain) {
  const std::string shown = shown_after([](Progress& progress) {
    progress.report_search(0.2, "first round");
    progress.report_search(0.92, "measuring");
    progress.report_search(0.88, "fitting");
    progress.report_search(0.92, "measuring again");
  });
  EXPECT_NE(shown.find("search: measuring again, "), std::string::npos) << shown;
  EXPECT_EQ(shown.find(" left"), std::string::npos) << shown;
  EXPECT_EQ(shown.find('%'), std::string::npos) << shown;
}

TEST(ProgressLine, EstimatesTheNextStepAgain) {
  const std::string shown = shown_after([](Progress& progress) {
    progress.report_search(0.92, "measuring");
    progress.report_search(0.88, "fitting");
    progress.begin("writing");
    progress.report(0.25, "curves");
    progress.report(0.75, "tables");
  });
  EXPECT_NE(shown.find("writing: 75 %, "), std::string::npos) << shown;
}

}  // namespace
}  // namespace upright::cli
