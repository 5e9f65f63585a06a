// `upright sweep` as a user and a cluster meet it: errors, Ctrl-C and going on, mpirun.
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
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

  /// A map over drawn plants, with some 20 tasks of a second in all.
  void write_uncertain(int samples) const {
    std::ofstream(file())
        << "sweep:\n  plant: " << source << "/config/plants/exponential.yaml\n  gains: " << source
        << "/config/gains/exponential.yaml\n  loop: sampled\n  rig: " << source
        << "/config/rigs/simulated.yaml\n  theta0_deg: [1, 2, 3, 4]\n"
        << "  delay_s: {from: 0.0, to: 0.03, count: 4}\n  duration_s: 3\n"
        << "  outcome: {stable_below_rad: 0.0016, fell_above_rad: 1.0}\n  engine: reproducible\n"
        << "  uncertainty: {percent: 5, samples: " << samples << ", seed: 1}\n";
  }

  static ssize_t write_byte(int to, char byte) { return ::write(to, &byte, 1); }

  std::string file() const { return (folder_ / "sweep.yaml").string(); }
  std::string out(const std::string& name) const { return (folder_ / name).string(); }

  void expect_same(const std::string& a, const std::string& b) const {
    std::vector<std::string> names{"sweep.csv", "transitions.csv", "sweep.yaml"};
    if (content(file()).find("uncertainty:") != std::string::npos) names.emplace_back("uncertainty.csv");
    for (const std::string& name : names) {
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
  EXPECT_NE(page.find("Falls for delays from"), std::string::npos);
  EXPECT_NE(page.find("oscillating"), std::string::npos);
  EXPECT_NE(page.find("<svg"), std::string::npos);
  // The linear critical delays of the sampled loop, as lines in the map and in words.
  EXPECT_NE(page.find("linear, near rest"), std::string::npos);
  EXPECT_NE(page.find("linear, sliding"), std::string::npos);
  const std::string margins = content(folder_ / "a" / "margins.csv");
  EXPECT_EQ(margins.find("model,critical_delay_s,crossing_radps\nnear rest,0."), 0u) << margins;
}

TEST_F(SweepCommand, ReportDrawsTheLinearCriticalDelay) {
  std::ofstream(file()) << "sweep:\n  plant: " << source
                        << "/config/plants/exponential.yaml\n  gains: " << source
                        << "/config/gains/exponential.yaml\n  loop: continuous\n"
                        << "  theta0_deg: [1, 3, 5]\n  delay_s: {from: 0.0, to: 0.03, count: 4}\n"
                        << "  duration_s: 2\n  outcome: {stable_below_rad: 0.0016, fell_above_rad: 1.0}\n"
                        << "  engine: fast\n";
  EXPECT_EQ(run_upright("sweep " + file() + " --out " + out("a")).exit_code, 0);
  EXPECT_EQ(run_upright("report " + out("a")).exit_code, 0);
  const std::string page = content(folder_ / "a" / "report.html");
  EXPECT_NE(page.find("loses stability at 106.9 ms and oscillates at 10.23 rad/s"), std::string::npos);
  EXPECT_NE(page.find("loses stability at 15.36 ms"), std::string::npos);
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

TEST_F(SweepCommand, RefusesBadInputWithTheRemedyAndWritesNothing) {
  std::ofstream(folder_ / "unstable.yaml")
      << "plant:\n  cart_mass_kg: 0.815\n  pendulum: {mass_kg: 0.21, length_to_com_m: 0.02}\n"
         "  gravity_mps2: 9.8\n  motor: {force_per_volt_n: 0.05, back_emf_n_per_mps: 7.682}\n"
         "  effects:\n    - {kind: viscous_friction, coefficient_n_per_mps: 3.0}\n";
  const std::tuple<std::string, std::string, std::string> wrong[] = {
      {"engine: fast", "engine: warp", "reference"},
      {"theta0_deg: {from: 0.5, to: 5, count: 7, spacing: log}", "theta0_deg: []", "at least one value"},
      {"delay_s: {from: 0.0, to: 0.04, count: 21}", "delay_s: []", "at least one value"},
      {"delay_s: {from: 0.0, to: 0.04, count: 21}", "delay_s: [0.0, 0.02, 0.01]", "sort the delays"},
      {"delay_s: {from: 0.0, to: 0.04, count: 21}", "delay_s: {from: 0.04, to: 0.0, count: 5}", "more than"},
      {"fell_above_rad: 1.0", "fell_above_rad: 0.001", "more than 0.0016"},
      {source + "/config/plants/exponential.yaml", (folder_ / "unstable.yaml").string(), "upright design"},
      {source + "/config/plants/exponential.yaml", (folder_ / "none.yaml").string(), "none.yaml"},
  };
  const std::string good = content(file());
  for (const auto& [from, to, remedy] : wrong) {
    SCOPED_TRACE(to);
    std::string text = good;
    ASSERT_NE(text.find(from), std::string::npos);
    text.replace(text.find(from), from.size(), to);
    std::ofstream(file()) << text;
    const CommandResult result = run_upright("sweep " + file() + " --out " + out("wrong"));
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find(remedy), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(std::filesystem::exists(out("wrong")));
  }
}

/// The rig's plant with its limits against the paper's experiment: 0.025 s for gain (7), 0.023 s for gain
/// (10).
TEST_F(SweepCommand, OnePlantFilePredictsTheFallsOfBothControllers) {
  const std::pair<const char*, double> measured[] = {{"rig-exponential", 0.025},
                                                     {"rig-exponential-gain10", 0.023}};
  for (const auto& [name, falls_s] : measured) {
    const CommandResult result = run_upright("sweep " + source + "/config/sweeps/" + name +
                                             ".yaml --transitions-only --json --out " + out(name));
    ASSERT_EQ(result.exit_code, 0) << result.err;
    for (const auto& transition : nlohmann::json::parse(result.out).at("transitions"))
      EXPECT_NEAR(transition.at("falls_from_s").get<double>(), falls_s, 0.1 * falls_s) << name;
  }
}

/// On a terminal: the bar shows the time left, Ctrl-C stops it, and the same command goes on from there.
TEST_F(SweepCommand, ShowsTheTimeLeftOnATerminalAndStopsOnItsCtrlC) {
  write("1000", "fast");
  const std::string to = out("cut");
  int terminal = -1;
  const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
  ASSERT_GE(child, 0);
  if (child == 0) {
    execl(UPRIGHT_BINARY, UPRIGHT_BINARY, "sweep", file().c_str(), "--threads", "1", "--out", to.c_str(),
          static_cast<char*>(nullptr));
    _exit(127);
  }
  std::string seen;
  bool asked = false;
  std::array<char, 4096> part;
  for (ssize_t count = 0; (count = read(terminal, part.data(), part.size())) > 0;) {
    seen.append(part.data(), static_cast<std::size_t>(count));
    // A number of seconds, which takes two reports; then Ctrl-C as the terminal sends it.
    if (!asked && std::regex_search(seen, std::regex("of [0-9]+ runs, [0-9]+ (s|min) left"))) {
      ASSERT_EQ(write_byte(terminal, '\x03'), 1);
      asked = true;
    }
  }
  close(terminal);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(asked) << seen;
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 3);
  EXPECT_NE(seen.find("same command again to continue"), std::string::npos) << seen;
  const CommandResult rest = run_upright("sweep " + file() + " --json --out " + to);
  ASSERT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_EQ(rest.err, "");  // no bar where stderr is no terminal
  const CommandResult whole = run_upright("sweep " + file() + " --json --out " + out("whole"));
  EXPECT_LT(nlohmann::json::parse(rest.out).at("runs_made"),
            nlohmann::json::parse(whole.out).at("runs_made"));
  expect_same("cut", "whole");
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

TEST_F(SweepCommand, SaysFirstWhichDelayFewPlantsFallAt) {
  write_uncertain(100);
  const CommandResult result = run_upright("sweep " + file() + " --json --out " + out("a"));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(std::regex_search(
      result.err,
      std::regex("sweep: 1616 runs of [0-9.e-]+ ms of processor time: about .* on [0-9]+ thread")))
      << result.err;
  const auto document = nlohmann::ordered_json::parse(result.out);
  EXPECT_EQ(document.begin().key(), "uncertainty");
  const auto& delays = document.at("uncertainty").at("fewer_than_5_percent_fall_up_to");
  ASSERT_EQ(delays.size(), 4u);
  std::istringstream rows(content(folder_ / "a" / "uncertainty.csv"));
  std::string row;
  std::getline(rows, row);
  EXPECT_EQ(
      row, "theta0_rad,delay_s,samples,share_falls,low,high,share_oscillates,oscillates_low,oscillates_high");
  for (const auto& delay : delays) {
    EXPECT_LT(delay.at("share_falls").get<double>(), 0.05);
    double tolerated = -1.0;
    bool holds = true;
    for (int i = 0; i < 4 && std::getline(rows, row); ++i) {
      std::istringstream cells(row);
      std::vector<double> numbers;
      for (std::string cell; std::getline(cells, cell, ',');) numbers.push_back(std::stod(cell));
      holds = holds && numbers.at(3) < 0.05;
      if (holds) tolerated = numbers.at(1);
    }
    EXPECT_EQ(delay.at("delay_s"), tolerated);
  }
  EXPECT_EQ(run_upright("report " + out("a")).exit_code, 0);
  const std::string page = content(folder_ / "a" / "report.html");
  EXPECT_NE(page.find("of 100 plants fall"), std::string::npos);
  EXPECT_NE(page.find("10 percent fall at [ms]"), std::string::npos);
  EXPECT_EQ(content(folder_ / "a" / "uncertainty.svg").find("<svg"), 0u);
}

TEST_F(SweepCommand, EstimatesOnlyAndWritesNothing) {
  write_uncertain(200);
  const CommandResult result =
      run_upright("sweep " + file() + " --estimate --json --threads 2 --out " + out("a"));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto document = nlohmann::json::parse(result.out);
  EXPECT_EQ(document.at("runs"), 16 * 201);
  EXPECT_NEAR(document.at("time_s").get<double>(),
              document.at("processor_s_per_run").get<double>() * 16 * 201 / 2, 1e-9);
  EXPECT_FALSE(std::filesystem::exists(out("a")));
}

/// kill -9 and Ctrl-C, several times in one map; then it goes on to its end.
TEST_F(SweepCommand, KeepsTheCountsOfPlantsOverKillAndInterrupt) {
  write_uncertain(250);
  const std::string to = out("cut");
  const auto lines = [&] {
    const std::string text = content(folder_ / "cut" / "sweep.partial");
    return std::count(text.begin(), text.end(), '\n');
  };
  std::ptrdiff_t before = 0;
  for (const int signal : {SIGKILL, SIGINT}) {
    const pid_t child = fork();
    if (child == 0) {
      execl(UPRIGHT_BINARY, UPRIGHT_BINARY, "sweep", file().c_str(), "--threads", "1", "--out", to.c_str(),
            static_cast<char*>(nullptr));
      _exit(127);
    }
    // The first lines are of the plain map and its transitions.
    const std::ptrdiff_t enough = std::max<std::ptrdiff_t>(before, 12) + 3;
    for (int i = 0; i < 6000 && lines() < enough; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    kill(child, signal);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_FALSE(std::filesystem::exists(folder_ / "cut" / "uncertainty.csv")) << "too late";
    EXPECT_GE(lines(), enough);
    before = lines();
  }
  EXPECT_NE(content(folder_ / "cut" / "sweep.partial").find("\n1000000 "), std::string::npos);
  const CommandResult rest = run_upright("sweep " + file() + " --json --out " + to);
  ASSERT_EQ(rest.exit_code, 0) << rest.err;
  const CommandResult whole = run_upright("sweep " + file() + " --json --out " + out("whole"));
  EXPECT_LT(nlohmann::json::parse(rest.out).at("runs_made"),
            nlohmann::json::parse(whole.out).at("runs_made"));
  expect_same("cut", "whole");
}

#ifdef UPRIGHT_WITH_MPI

class SweepOverMpi : public SweepCommand {
 protected:
  static std::string ranks_of(int ranks, const std::string& arguments) {
    return "-n " + std::to_string(ranks) + " " + shell_quoted(UPRIGHT_BINARY) + " sweep " + arguments;
  }
  CommandResult mpirun(const std::string& programs) const {
    return run_shell("ASAN_OPTIONS=detect_leaks=0 " + shell_quoted(UPRIGHT_MPIRUN) +
                     " --allow-run-as-root --oversubscribe " + programs);
  }
  CommandResult with_ranks(int ranks, const std::string& arguments) const {
    return mpirun(ranks_of(ranks, arguments));
  }
};

TEST_F(SweepOverMpi, GivesTheBytesOfOneProcessOverTwoAndThree) {
  EXPECT_EQ(run_upright("sweep " + file() + " --out " + out("one")).exit_code, 0);
  for (const int ranks : {1, 2, 3}) {
    const std::string to = std::to_string(ranks) + "-ranks";
    const CommandResult result = with_ranks(ranks, file() + " --out " + out(to));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    expect_same("one", to);
  }
}

TEST_F(SweepOverMpi, CountsThePlantsAsOneProcessDoes) {
  write_uncertain(100);
  EXPECT_EQ(run_upright("sweep " + file() + " --out " + out("one")).exit_code, 0);
  for (const int ranks : {1, 2, 4}) {
    const std::string to = std::to_string(ranks) + "-ranks";
    const CommandResult result = with_ranks(ranks, file() + " --out " + out(to));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    expect_same("one", to);
  }
}

TEST_F(SweepOverMpi, SpeaksOnceAndWithTheSameExitCode) {
  write("4", "quick");
  const CommandResult result = with_ranks(2, file() + " --out " + out("a"));
  EXPECT_EQ(result.exit_code, 2);
  const std::size_t first = result.err.find("sweep.yaml:10");
  EXPECT_NE(first, std::string::npos) << result.err;
  EXPECT_EQ(result.err.find("sweep.yaml:10", first + 1), std::string::npos) << result.err;
}

/// As on a machine that does not have the file.
TEST_F(SweepOverMpi, SaysWhichOtherRankCannotReadTheFile) {
  write("4", "fast");
  const CommandResult result =
      mpirun(ranks_of(2, file() + " --out " + out("a")) + " : " + ranks_of(1, "no-such-file.yaml"));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("rank 2 of mpirun cannot read"), std::string::npos) << result.err;
}

#else

TEST_F(SweepCommand, GivesTheBytesOfOneProcessOverTwoAndThreeRanks) {
  GTEST_SKIP() << "NOT TESTED: MPI is not built in. Install libopenmpi-dev and configure again";
}

#endif

}  // namespace
}  // namespace upright::testing
