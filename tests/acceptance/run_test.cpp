// `upright run` and `upright replay` as a user meets them, with the ways a run can be cut short.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <numeric>
#include <sstream>
#include <thread>
#include <vector>

#include "command.hpp"
#include "tests/support/run_end.hpp"

namespace upright::testing {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

std::string config(const std::string& name) {
  return shell_quoted(UPRIGHT_SOURCE_DIR "/config/" + name);
}

std::string run_arguments(const TemporaryFolder& folder, const std::string& more,
                          const std::string& rig = config("rigs/simulated.yaml")) {
  return "run --rig " + rig + " --gains " + config("gains/exponential.yaml") + " --out " +
         shell_quoted(folder.path().string()) + " " + more;
}

std::string last_line(const std::string& text) {
  const std::size_t end = text.find_last_not_of('\n');
  const std::size_t begin = text.rfind('\n', end);
  return text.substr(begin + 1, end - begin);
}

fs::path only_run_in(const TemporaryFolder& folder) {
  fs::path found;
  for (const auto& entry : fs::directory_iterator(folder.path())) found = entry.path();
  return found;
}

std::string rig_with_plant(const TemporaryFolder& folder, const std::string& plant,
                           const std::string& jitter) {
  std::string text = read_text(UPRIGHT_SOURCE_DIR "/config/rigs/simulated.yaml");
  const std::string old_plant = "../plants/exponential.yaml";
  text.replace(text.find(old_plant), old_plant.size(),
               UPRIGHT_SOURCE_DIR "/config/plants/" + plant + ".yaml");
  const std::string old_jitter = "timing_jitter_s: 0.0";
  text.replace(text.find(old_jitter), old_jitter.size(), "timing_jitter_s: " + jitter);
  return shell_quoted(folder.write(plant + ".yaml", text).string());
}

TEST(Run, StaysUpForAMinuteOnEachFrictionAndReplays) {
  const TemporaryFolder rigs;
  for (const char* plant : {"viscous", "exponential", "dynamic"}) {
    const TemporaryFolder folder;
    const CommandResult result = run_upright(run_arguments(
        folder, "--fast --duration 60 --theta0-deg 3 --json", rig_with_plant(rigs, plant, "0.0")));
    ASSERT_EQ(result.exit_code, 0) << plant << result.err;
    const auto json = nlohmann::json::parse(result.out);
    EXPECT_TRUE(json.at("stayed_up").get<bool>());
    EXPECT_EQ(json.at("counts").at("periods"), 60000);
    const std::string directory = json.at("run_directory");
    const CommandResult replayed = run_upright("replay " + shell_quoted(directory));
    EXPECT_EQ(replayed.exit_code, 0) << replayed.out;
  }
}

TEST(Run, SumsUpHowLateItWokeAndHowLongItTookAsHistograms) {
  const TemporaryFolder folder;
  const CommandResult text = run_upright(run_arguments(folder, "--duration 0.5 --theta0-deg 1"));
  for (const char* part : {"wake-up late by", "cycle took", " us to ", "#"})
    EXPECT_NE(text.out.find(part), std::string::npos) << part << "\n" << text.out;
  const CommandResult result = run_upright(run_arguments(folder, "--duration 0.5 --theta0-deg 1 --json"));
  const auto json = nlohmann::json::parse(result.out);
  const std::string run_yaml = read_text(fs::path(json.at("run_directory").get<std::string>()) / "run.yaml");
  for (const char* part : {"wake_late", "read", "compute", "write", "cycle"}) {
    const auto& timing = json.at("timing").at(part);
    const std::vector<std::uint64_t> counts = timing.at("histogram_count");
    EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}), timing.at("count")) << part;
    EXPECT_EQ(timing.at("histogram_upper_us").size(), counts.size());
    EXPECT_NE(run_yaml.find("\n    " + std::string(part) + ":\n      mean_us: "), std::string::npos) << part;
  }
  EXPECT_NE(run_yaml.find("histogram_upper_us: ["), std::string::npos);
}

TEST(Run, HasNoHistogramsInVirtualTime) {
  const TemporaryFolder folder;
  const CommandResult result = run_upright(run_arguments(folder, "--fast --duration 1"));
  EXPECT_EQ(result.out.find("wake-up"), std::string::npos) << result.out;
}

TEST(Run, PrintsTheRunDirectoryOnItsLastLine) {
  const TemporaryFolder folder;
  const CommandResult result = run_upright(run_arguments(folder, "--fast --duration 1 --label bench-1"));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(last_line(result.out), only_run_in(folder).string());
  EXPECT_TRUE(last_line(result.out).ends_with("-bench-1"));
  EXPECT_TRUE(result.err.empty()) << result.err;
}

TEST(Run, WaitsForNoPageOfMemoryWhileItRuns) {
  const TemporaryFolder folder;
  const CommandResult result = run_upright(run_arguments(folder, "--duration 3 --theta0-deg 1 --json"));
  const auto json = nlohmann::json::parse(result.out);
  if (json.at("scheduling").get<std::string>().find("memory not locked") != std::string::npos)
    GTEST_SKIP() << "NOT TESTED: page faults, because memory could not be locked. Raise the limit memlock";
  EXPECT_EQ(json.at("counts").at("page_faults"), 0) << result.out;
}

TEST(Run, SameSeedSameBytes) {
  const TemporaryFolder rigs, first, second, other;
  const std::string rig = rig_with_plant(rigs, "exponential", "0.0001");
  for (const TemporaryFolder* folder : {&first, &second})
    ASSERT_EQ(run_upright(run_arguments(*folder, "--fast --duration 5 --seed 7", rig)).exit_code, 0);
  ASSERT_EQ(run_upright(run_arguments(other, "--fast --duration 5 --seed 8", rig)).exit_code, 0);
  const std::string bytes = read_text(only_run_in(first) / "samples.csv");
  EXPECT_EQ(bytes, read_text(only_run_in(second) / "samples.csv"));
  EXPECT_NE(bytes, read_text(only_run_in(other) / "samples.csv"));
}

TEST(Run, AFallIsExitCodeThreeAndKeepsItsRows) {
  const TemporaryFolder folder;
  const CommandResult result =
      run_upright(run_arguments(folder, "--fast --duration 20 --theta0-deg 5 --delay 0.1 --json"));
  EXPECT_EQ(result.exit_code, 3);
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_FALSE(json.at("stayed_up").get<bool>());
  EXPECT_TRUE(json.at("outcome") == "fell" || json.at("reason") == "track_limit") << json;
  EXPECT_GT(json.at("rows_written"), 50);
  EXPECT_EQ(run_upright("replay " + shell_quoted(json.at("run_directory"))).exit_code, 0);
}

TEST(Run, RefusesWrongUseBeforeAnythingIsMade) {
  const TemporaryFolder folder;
  const std::string tcp = config("rigs/modbus-tcp.yaml");
  const std::vector<std::string> wrong = {
      run_arguments(folder, "--duration 0"),
      run_arguments(folder, "--duration nan"),
      run_arguments(folder, "--delay -1"),
      run_arguments(folder, "--delay 1e9"),
      run_arguments(folder, "--theta0-deg 1e9"),
      run_arguments(folder, "--fast --label ../x"),
      run_arguments(folder, "--fast", tcp),
      run_arguments(folder, "--theta0-deg 3", tcp),
      run_arguments(folder, "", "/nowhere/rig.yaml"),
      "run --rig " + config("rigs/simulated.yaml"),
  };
  for (const std::string& arguments : wrong) {
    const CommandResult result = run_upright(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments << result.err;
    EXPECT_TRUE(result.err.starts_with("upright: ")) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

/// The command in a process of its own, with stdout in a file.
class Started {
 public:
  explicit Started(const std::string& arguments) {
    pid_ = fork();
    if (pid_ != 0) return;
    const std::string line = "exec " + shell_quoted(UPRIGHT_BINARY) + " " + arguments + " >/dev/null 2>&1";
    execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    _exit(127);
  }
  ~Started() {
    if (pid_ > 0) wait_after(SIGKILL);
  }
  Started(const Started&) = delete;
  Started& operator=(const Started&) = delete;

  int wait_after(int signal) {
    kill(pid_, signal);
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  pid_t pid_ = -1;
};

/// Waits for rows in the one run of a folder; empty when none came.
fs::path wait_for_rows(const TemporaryFolder& folder) {
  for (int i = 0; i < 500; ++i) {
    const fs::path run = only_run_in(folder);
    std::error_code problem;
    constexpr std::uintmax_t some_rows = 20'000;
    if (!run.empty() && fs::file_size(run / "samples.csv", problem) > some_rows && !problem) return run;
    std::this_thread::sleep_for(20ms);
  }
  return {};
}

std::vector<std::string> rows_of(const fs::path& run) {
  std::istringstream lines(read_text(run / "samples.csv"));
  std::vector<std::string> rows;
  for (std::string line; std::getline(lines, line);) rows.push_back(line);
  return rows;
}

/// In virtual time: a signal comes between two periods there as well.
TEST(Run, SignalsEndInZeroVoltsAndACompleteRunDirectory) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const TemporaryFolder folder;
    Started run(run_arguments(folder, "--fast --duration 86400"));
    const fs::path directory = wait_for_rows(folder);
    ASSERT_FALSE(directory.empty());
    EXPECT_EQ(run.wait_after(signal), 3);
    const std::string yaml = read_text(directory / "run.yaml");
    EXPECT_NE(yaml.find("reason: signal"), std::string::npos);
    EXPECT_EQ(run_upright("replay " + shell_quoted(directory.string())).exit_code, 0);
  }
}

void kill_after(std::chrono::milliseconds alive) {
  const TemporaryFolder folder;
  Started run(run_arguments(folder, "--duration 60"));
  const fs::path directory = wait_for_rows(folder);
  ASSERT_FALSE(directory.empty());
  std::this_thread::sleep_for(alive);
  // Rows that are older than 0.1 s when the process dies: those whose time had come when the file was this
  // long.
  const test::Since looked;
  const std::vector<std::string> before = rows_of(directory);
  std::this_thread::sleep_for(300ms);
  const test::Interval growing = looked.until_now();
  const int status = run.wait_after(SIGKILL);
  if (const auto end = test::run_end(read_text(directory / "run.yaml"))) EXPECT_END(*end, false);
  ASSERT_EQ(status, 128 + SIGKILL);
  const std::vector<std::string> after = rows_of(directory);
  const double grown_s = static_cast<double>(after.size() - before.size()) * 0.001;
  EXPECT_TIMING(growing, grown_s > 0.15, "the log has grown");
  const CommandResult replayed = run_upright("replay --json " + shell_quoted(directory.string()));
  EXPECT_EQ(replayed.exit_code, 0) << replayed.out << replayed.err;
  EXPECT_GE(nlohmann::json::parse(replayed.out).at("rows").get<std::size_t>() + 2, after.size());
}

TEST(Run, KilledAtAnyMomentItKeepsEveryRowOlderThanATenthOfASecond) {
  for (int kill = 0; kill < 5 && !IsSkipped(); ++kill)
    test::in_real_time([=] { kill_after(std::chrono::milliseconds(137 * kill)); });
}

TEST(Run, AWriteThatFailsStopsTheMotorAndKeepsTheRows) {
  const TemporaryFolder folder;
  const CommandResult result = run_shell("ulimit -f 400; " + shell_quoted(UPRIGHT_BINARY) + " " +
                                         run_arguments(folder, "--fast --duration 600"));
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_NE(result.err.find("free space"), std::string::npos) << result.err;
  const fs::path directory = only_run_in(folder);
  EXPECT_GT(rows_of(directory).size(), 1000u);
  EXPECT_NE(read_text(directory / "run.yaml").find("reason: log_failed"), std::string::npos);
  EXPECT_EQ(run_upright("replay " + shell_quoted(directory.string())).exit_code, 0);
}

TEST(Replay, NamesTheFirstRowThatDiffers) {
  const TemporaryFolder folder;
  ASSERT_EQ(run_upright(run_arguments(folder, "--fast --duration 1")).exit_code, 0);
  const fs::path directory = only_run_in(folder);
  std::string text = read_text(directory / "samples.csv");
  const std::size_t row = text.find("\n500,");
  ASSERT_NE(row, std::string::npos);
  // One more count of the cart in one row.
  std::size_t cell = text.find(',', text.find(',', row) + 1) + 1;
  text.insert(cell, text[cell] == '-' ? "" : "1");
  if (text[cell] == '-') text.insert(cell + 1, "1");
  std::ofstream(directory / "samples.csv", std::ios::binary) << text;
  const CommandResult result = run_upright("replay --json " + shell_quoted(directory.string()));
  EXPECT_EQ(result.exit_code, 3) << result.out;
  EXPECT_EQ(nlohmann::json::parse(result.out).at("first_mismatch").at("tick"), 500);
}

TEST(Replay, RefusesWhatIsNoRunDirectory) {
  const TemporaryFolder folder;
  for (const std::string& name : {std::string("/nowhere"), folder.path().string()}) {
    const CommandResult result = run_upright("replay " + shell_quoted(name));
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("name a run directory"), std::string::npos) << result.err;
  }
}

}  // namespace
}  // namespace upright::testing
