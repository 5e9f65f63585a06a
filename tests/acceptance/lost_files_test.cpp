// What other programs do to a command's folder while it works: lost data are never a success, what was lost
// is said, and data that are only elsewhere are found.
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "../integration/virtual_rig_process.hpp"
#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";

class LostFiles : public ::testing::Test {
 protected:
  static std::string quoted(const fs::path& path) { return shell_quoted(path.string()); }

  /// A run in virtual time that would take minutes, or in real time of `duration`; `meddle` is called with
  /// its directory once it has rows.
  CommandResult run_while(const std::string& flags, const std::function<void(const fs::path&)>& meddle) {
    const fs::path runs = folder_.path() / "runs";
    std::thread meddler([&] {
      if (test::wait_for_rows(runs)) meddle(test::only_entry(runs));
    });
    CommandResult result = run_shell("timeout 60 " + shell_quoted(UPRIGHT_BINARY) + " run --rig " + config +
                                     "rigs/simulated.yaml --gains " + config +
                                     "gains/exponential.yaml --out " + quoted(runs) + " " + flags);
    meddler.join();
    return result;
  }

  TemporaryFolder folder_;
};

const std::string without_end = "--fast --duration 1000000", three_seconds = "--duration 3",
                  some_seconds = "--fast --duration 600";

TEST_F(LostFiles, ARunWhoseFolderIsRemovedStops) {
  for (const std::string& flags : {without_end, three_seconds}) {
    const CommandResult result = run_while(flags, [](const fs::path& run) { fs::remove_all(run); });
    EXPECT_EQ(result.exit_code, 3) << result.out << result.err;
    EXPECT_NE(result.err.find("was removed during the run"), std::string::npos) << result.err;
    EXPECT_EQ(result.out.find("Stayed up"), std::string::npos) << result.out;
  }
}

TEST_F(LostFiles, ARunWhoseSamplesAreRemovedOrCutStopsAndSaysSo) {
  const std::pair<const char*, std::function<void(const fs::path&)>> cases[] = {
      {"was removed", [](const fs::path& run) { fs::remove(run / "samples.csv"); }},
      {"was moved or replaced",
       [](const fs::path& run) { fs::rename(run / "samples.csv", run / "mine.csv"); }},
      {"was truncated", [](const fs::path& run) { fs::resize_file(run / "samples.csv", 0); }}};
  for (const auto& [words, meddle] : cases) {
    const CommandResult result = run_while(without_end, meddle);
    EXPECT_EQ(result.exit_code, 3) << words << result.err;
    EXPECT_NE(result.err.find(words), std::string::npos) << result.err;
    const fs::path run = test::only_entry(folder_.path() / "runs");
    const std::string yaml = read_text(run / "run.yaml");
    EXPECT_NE(yaml.find("reason: log_failed"), std::string::npos) << words;
    EXPECT_NE(yaml.find(words), std::string::npos) << yaml.substr(yaml.find("outcome:"), 500);
    fs::remove_all(run);
  }
}

TEST_F(LostFiles, ARunWhoseFolderIsMovedIsWholeWhereItIs) {
  const fs::path elsewhere = folder_.path() / "elsewhere";
  const CommandResult result =
      run_while(some_seconds, [&](const fs::path& run) { fs::rename(run, elsewhere); });
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_NE(result.err.find("was moved to " + elsewhere.string()), std::string::npos) << result.err;
  EXPECT_NE(result.out.find(elsewhere.string() + "\n"), std::string::npos) << result.out;
  EXPECT_NE(read_text(elsewhere / "run.yaml").find("result: completed"), std::string::npos);
  EXPECT_EQ(run_upright("replay " + quoted(elsewhere)).exit_code, 0);
}

TEST_F(LostFiles, ASweepWhoseFolderIsRemovedOrMovedFails) {
  const fs::path out = folder_.path() / "sweep", elsewhere = folder_.path() / "elsewhere";
  const std::pair<std::string, std::function<void()>> cases[] = {
      {"was removed", [&] { fs::remove_all(out); }},
      {"was moved to " + elsewhere.string(), [&] { fs::rename(out, elsewhere); }}};
  for (const auto& [words, meddle] : cases) {
    std::thread meddler([&] {
      const fs::path journal = out / "sweep.partial";
      std::error_code none_yet;
      for (int i = 0; i < 4000 && !(fs::exists(journal, none_yet) && fs::file_size(journal, none_yet) > 200);
           ++i)
        std::this_thread::sleep_for(5ms);
      meddle();
    });
    const CommandResult result =
        run_upright("sweep " + config + "sweeps/exponential.yaml --threads 1 --out " + quoted(out));
    meddler.join();
    EXPECT_EQ(result.exit_code, 2) << result.out << result.err;
    EXPECT_NE(result.err.find(words), std::string::npos) << result.err;
  }
}

TEST_F(LostFiles, ASweepEndedWhileItWroteItsResultsGoesOn) {
  const fs::path file = folder_.write(
      "sweep.yaml",
      "sweep:\n  plant: " + config + "plants/exponential.yaml\n  gains: " + config +
          "gains/exponential.yaml\n  loop: continuous\n  theta0_deg: [1, 3]\n  delay_s: {from: 0.0, "
          "to: 0.12, count: 5}\n  duration_s: 5\n  outcome: {stable_below_rad: 0.0016, "
          "fell_above_rad: 1.0}\n  engine: fast\n");
  const fs::path out = folder_.path() / "out";
  const std::string command = "sweep " + quoted(file) + " --out " + quoted(out);
  // The last of the results cannot be written: all before it are there.
  fs::create_directories(out / "sweep.csv.new");
  const CommandResult ended = run_upright(command);
  EXPECT_EQ(ended.exit_code, 2) << ended.err;
  EXPECT_TRUE(fs::exists(out / "transitions.csv"));
  EXPECT_FALSE(fs::exists(out / "sweep.csv"));
  fs::remove_all(out / "sweep.csv.new");
  const CommandResult again = run_upright(command);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(again.out.find("0 runs simulated") == std::string::npos, false) << again.out;
  EXPECT_TRUE(fs::exists(out / "sweep.csv"));
  EXPECT_FALSE(fs::exists(out / "sweep.partial"));
  EXPECT_EQ(run_upright(command).exit_code, 2) << "a finished sweep is not replaced";
}

TEST_F(LostFiles, AnExperimentNeverPassesOverARunThatIsGone) {
  const fs::path file = folder_.write(
      "two.yaml", "experiment:\n  name: two\n  why: a test\n  plant: " + config +
                      "plants/exponential.yaml\n  travel_m: 0.3\n  voltage_limit_v: 10\n  pieces:\n"
                      "    - {kind: observe, label: first, duration_s: 1}\n"
                      "    - {kind: observe, label: second, duration_s: 1}\n");
  const fs::path out = folder_.path() / "out";
  const std::string command =
      "experiment " + quoted(file) + " --rig " + config + "rigs/simulated.yaml --fast --out " + quoted(out);
  ASSERT_EQ(run_upright(command).exit_code, 0);
  std::string trials = read_text(out / "trials.csv");
  trials.resize(trials.rfind('\n', trials.size() - 2) + 1);  // the second is yet to be made
  std::ofstream(out / "trials.csv", std::ios::binary) << trials;
  fs::path first;
  for (const auto& entry : fs::directory_iterator(out))
    if (entry.path().filename().string().ends_with("-first")) first = entry.path();
  fs::remove_all(first);
  const CommandResult result = run_upright(command);
  EXPECT_EQ(result.exit_code, 3) << result.out << result.err;
  EXPECT_NE(result.err.find(first.filename().string() + " was removed"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace upright::testing
