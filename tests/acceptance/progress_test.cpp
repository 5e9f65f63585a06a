// What takes long says how far it is, on stderr: on a terminal in one line that is drawn anew, elsewhere with
// a line every ten seconds. Stdout has the results only.
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <vector>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";
const std::string rig = config + "rigs/simulated.yaml", gains = config + "gains/exponential.yaml";

/// Runs the program on a terminal of its own until it has said what `wanted` matches, or has ended; what it
/// said.
std::string said_on_terminal(const std::vector<std::string>& arguments, const std::regex& wanted) {
  std::vector<const char*> words{UPRIGHT_BINARY};
  for (const std::string& word : arguments) words.push_back(word.c_str());
  words.push_back(nullptr);
  int terminal = -1;
  const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
  if (child == 0) {
    execv(words[0], const_cast<char* const*>(words.data()));
    _exit(127);
  }
  std::string seen;
  std::array<char, 4096> part;
  const auto until = std::chrono::steady_clock::now() + 60s;
  while (std::chrono::steady_clock::now() < until && !std::regex_search(seen, wanted)) {
    pollfd one{terminal, POLLIN, 0};
    if (poll(&one, 1, 100) <= 0) continue;
    const ssize_t count = read(terminal, part.data(), part.size());
    if (count <= 0) break;
    seen.append(part.data(), static_cast<std::size_t>(count));
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  close(terminal);
  return seen;
}

const std::regex elapsed_and_left("[0-9]+ %.*[0-9] (s|min) left.*[0-9]+ s elapsed");

class ShowsProgress : public ::testing::Test {
 protected:
  std::string out(const std::string& name) const { return (folder_.path() / name).string(); }
  TemporaryFolder folder_;
};

TEST_F(ShowsProgress, OfAFastRunOnATerminal) {
  const std::string said = said_on_terminal(
      {"run", "--rig", rig, "--gains", gains, "--fast", "--duration", "100000", "--out", out("runs")},
      elapsed_and_left);
  EXPECT_TRUE(std::regex_search(said, elapsed_and_left)) << said;
}

TEST_F(ShowsProgress, OfASweepOnATerminal) {
  std::string sweep = read_text(config + "sweeps/exponential.yaml");
  for (const char* folder : {"../plants/", "../gains/"}) sweep.replace(sweep.find(folder), 3, config);
  sweep.replace(sweep.find("engine: fast"), 12, "engine: reference");
  const std::string file = folder_.write("sweep.yaml", sweep).string();
  const std::string said =
      said_on_terminal({"sweep", file, "--threads", "1", "--out", out("sweep")}, elapsed_and_left);
  EXPECT_TRUE(std::regex_search(said, elapsed_and_left)) << said;
}

TEST_F(ShowsProgress, OfAnExperimentOnATerminal) {
  const std::regex elapsed("[0-9]+ s elapsed");
  const std::string said = said_on_terminal({"experiment", config + "experiments/delay-sweep-swing-up.yaml",
                                             "--rig", rig, "--fast", "--out", out("experiment")},
                                            elapsed);
  EXPECT_TRUE(std::regex_search(said, elapsed)) << said;
}

TEST_F(ShowsProgress, OfDoctorOnATerminal) {
  const std::string said = said_on_terminal({"doctor", "--seconds", "5"}, elapsed_and_left);
  EXPECT_TRUE(std::regex_search(said, elapsed_and_left)) << said;
}

TEST_F(ShowsProgress, InALineEveryTenSecondsWhereThereIsNoTerminal) {
  const CommandResult result =
      run_shell("timeout -s INT 11 " + shell_quoted(UPRIGHT_BINARY) + " run --rig " + rig + " --gains " +
                gains + " --fast --json --duration 1000000 --out " + out("runs"));
  EXPECT_TRUE(std::regex_search(result.err, std::regex("^upright: run: [0-9]+ %.* left, 10 s elapsed\n")))
      << result.err;
  EXPECT_EQ(result.err.find('\r'), std::string::npos);
  EXPECT_TRUE(nlohmann::json::accept(result.out)) << result.out;
}

TEST_F(ShowsProgress, NotForWhatEndsAtOnce) {
  const std::string said = said_on_terminal(
      {"margin", config + "plants/viscous.yaml", config + "gains/viscous.yaml"}, std::regex("never said"));
  EXPECT_EQ(said.find("elapsed"), std::string::npos) << said;
}

}  // namespace
}  // namespace upright::testing
