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

/// What the terminal of a process shows that does this.
std::string shown_on_terminal(const std::function<void()>& work) {
  int terminal = -1;
  const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
  if (child == 0) {
    work();
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

void show() {
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
}

TEST(ProgressLine, EstimatesTheTimeThatIsLeft) {
  const std::string shown = shown_on_terminal([] {
    Progress progress("search");
    progress.report(0.2, "first round");
    progress.report(0.5, "second round");
    progress.report(0.4, "a round of its own");
    show();
  });
  EXPECT_NE(shown.find("50 %, a round of its own, "), std::string::npos) << shown;
  EXPECT_NE(shown.find(" left, "), std::string::npos) << shown;
}

TEST(ProgressLine, HasNoEstimateOfWorkThatBeginsAgain) {
  const std::string shown = shown_on_terminal([] {
    Progress progress("search");
    progress.report(0.2, "first round");
    progress.report(0.92, "measuring");
    progress.report(0.88, "fitting");
    progress.report(0.92, "measuring again");
    show();
  });
  EXPECT_NE(shown.find("search: measuring again, "), std::string::npos) << shown;
  EXPECT_EQ(shown.find(" left"), std::string::npos) << shown;
  EXPECT_EQ(shown.find('%'), std::string::npos) << shown;
}

TEST(ProgressLine, EstimatesTheNextStepAgain) {
  const std::string shown = shown_on_terminal([] {
    Progress progress("search");
    progress.report(0.92, "measuring");
    progress.report(0.88, "fitting");
    progress.begin("writing");
    progress.report(0.25, "curves");
    progress.report(0.75, "tables");
    show();
  });
  EXPECT_NE(shown.find("writing: 75 %, "), std::string::npos) << shown;
}

}  // namespace
}  // namespace upright::cli
