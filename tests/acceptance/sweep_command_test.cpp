// `upright sweep` as a user and a cluster meet it: errors, Ctrl-C and going on, mpirun.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "command.hpp"

namespace upright::testing {
namespace {

const std::string source = UPRIGHT_SOURCE_DIR;

class SweepCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("upright-sweep-command-" + std::to_string(getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    write("4", "fast");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& duration_s, const std::string& engine) const {
    std::ofstream(file())
        << "sweep:\n  plant: " << source << "/config/plants/exponential.yaml\n  gains: " << source
        << "/config/gains/exponential.yaml\n  loop: sampled\n  rig: " << source
        << "/config/rigs/simulated.yaml\n  theta0_deg: {from: 0.5, to: 5, count: 7, spacing: log}\n"
        << "  delay_s: {from: 0.0, to: 0.04, count: 21}\n  duration_s: " << duration_s
        << "\n  outcome: {stable_below_rad: 0.0016, fell_above_rad: 1.0}\n  engine: " << engine << "\n";
  }

  std::string file() const { return (folder_ / "sweep.yaml").string(); }
  std::string out(const std::string& name) const { return (folder_ / name).string(); }

  void expect_same(const std::string& a, const std::string& b) const {
    for (const char* name : {"sweep.csv", "transitions.csv", "sweep.yaml"}) {
      const std::string text = content(folder_ / a / name);
      EXPECT_FALSE(text.empty()) << name;
      EXPECT_EQ(text, content(folder_ / b / name)) << name;
    }
  }

  static std::string content(const std::filesystem::path& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }

  std::filesystem::path folder_;
};

TEST_F(SweepCommand, WritesItsResultsAndOneJsonDocument) {
  const CommandResult result = run_upright("sweep " + file() + " --json --out " + out("a"));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const auto document = nlohmann::json::parse(result.out);
  EXPECT_EQ(document.at("runs"), 147);
  EXPECT_EQ(document.at("transitions").size(), 7u);
  EXPECT_EQ(content(folder_ / "a" / "sweep.csv").substr(0, 81),
            "theta0_rad,delay_s,outcome,theta_amplitude_rad,cart_amplitude_m,fall_time_s\n0.008");
}

TEST_F(SweepCommand, ReportDrawsTheMap) {
  EXPECT_EQ(run_upright("sweep " + file() + " --out " + out("a")).exit_code, 0);
  const CommandResult report = run_upright("report " + out("a"));
  EXPECT_EQ(report.exit_code, 0) << report.err;
  const std::string page = content(folder_ / "a" / "report.html");
  EXPECT_NE(page.find("Falls from"), std::string::npos);
  EXPECT_NE(page.find("oscillating"), std::string::npos);
  EXPECT_NE(page.find("<svg"), std::string::npos);
}

TEST_F(SweepCommand, RefusesToOverwriteAndSaysHow) {
  EXPECT_EQ(run_upright("sweep " + file() + " --out " + out("a")).exit_code, 0);
  const CommandResult again = run_upright("sweep " + file() + " --out " + out("a"));
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("--overwrite"), std::string::npos) << again.err;
  EXPECT_EQ(run_upright("sweep " + file() + " --overwrite --out " + out("a")).exit_code, 0);
}

TEST_F(SweepCommand, RefusesAnUnknownEngineWithFileLineAndKey) {
  write("4", "quick");
  const CommandResult result = run_upright("sweep " + file() + " --out " + out("a"));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("sweep.yaml:10"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("engine"), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(out("a")));
}

TEST_F(SweepCommand, KeepsWhatIsDoneOnAnInterruptAndGoesOn) {
  write("60", "fast");
  const std::string to = out("cut");
  const pid_t child = fork();
  if (child == 0) {
    execl(UPRIGHT_BINARY, UPRIGHT_BINARY, "sweep", file().c_str(), "--threads", "1", "--out", to.c_str(),
          static_cast<char*>(nullptr));
    _exit(127);
  }
  const auto journal = folder_ / "cut" / "sweep.partial";
  const auto lines = [&] {
    const std::string text = content(journal);
    return std::count(text.begin(), text.end(), '\n');
  };
  for (int i = 0; i < 6000 && lines() < 2; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  kill(child, SIGINT);
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 3);
  EXPECT_GE(lines(), 2);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "cut" / "sweep.csv"));

  EXPECT_EQ(run_upright("sweep " + file() + " --out " + to).exit_code, 0);
  EXPECT_EQ(run_upright("sweep " + file() + " --out " + out("whole")).exit_code, 0);
  expect_same("cut", "whole");
}

TEST_F(SweepCommand, GivesTheSameBytesOverTwoAndThreeRanks) {
  if (std::system("command -v mpirun >/dev/null 2>&1") != 0) GTEST_SKIP() << "no mpirun on this machine";
  EXPECT_EQ(run_upright("sweep " + file() + " --out " + out("one")).exit_code, 0);
  const CommandResult probe =
      run_shell("PMIX_RANK=0 " + shell_quoted(UPRIGHT_BINARY) + " sweep nothing.yaml");
  if (probe.err.find("built without MPI") != std::string::npos) GTEST_SKIP() << probe.err;
  for (const char* ranks : {"2", "3"}) {
    const std::string command =
        std::string("ASAN_OPTIONS=detect_leaks=0 mpirun --allow-run-as-root --oversubscribe -n ") + ranks +
        " " + UPRIGHT_BINARY + " sweep " + file() + " --out " + out(ranks) + " >/dev/null 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0);
    expect_same("one", ranks);
  }
}

}  // namespace
}  // namespace upright::testing
