// How late a loop may be, as `run` and `experiment` set it and say it. The run directory is the witness.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";
const std::string rig = " --rig " + config + "rigs/simulated.yaml";
const std::string gains = " --gains " + config + "gains/exponential.yaml";

/// `most_periods_late` in a run's run.yaml.
int limit_in(const fs::path& run) {
  const std::string text = read_text(run / "run.yaml"), key = "most_periods_late: ";
  const std::size_t at = text.find(key);
  return at == std::string::npos ? -1 : std::stoi(text.substr(at + key.size()));
}

std::string run_at(const std::string& delay_s, const TemporaryFolder& folder) {
  return "run" + rig + gains + " --fast --duration 1 --delay " + delay_s + " --out " + folder.path().string();
}

TEST(RunOverrunLimit, IsTheTightestBeyondTheSlidingMargin) {
  const TemporaryFolder folder;
  int before = 1000;
  for (const std::string delay : {"0", "0.005", "0.010", "0.015", "0.020", "0.050"}) {
    const CommandResult result = run_upright(run_at(delay, folder) + " --json");
    const Json document = Json::parse(result.out);
    const int limit = limit_in(document.at("run_directory").get<std::string>());
    EXPECT_EQ(document.at("most_periods_late"), limit);
    EXPECT_LE(limit, before) << delay;
    before = limit;
    const bool beyond = std::stod(delay) > 0.0142;
    EXPECT_EQ(document.at("delay_margin").at("exceeded"), beyond) << delay;
    EXPECT_EQ(document.at("warning").is_null(), !beyond) << delay;
    EXPECT_EQ(document.at("delay_margin").at("extra_delay_s").get<double>() > 0.0, !beyond) << delay;
  }
  EXPECT_EQ(before, 3);
}

TEST(RunOverrunLimit, OneSentenceSaysThatTheLoopOscillatesOrFalls) {
  const TemporaryFolder folder;
  const CommandResult loud = run_upright(run_at("0.020", folder));
  EXPECT_NE(loud.err.find("WILL OSCILLATE OR FALL"), std::string::npos) << loud.err;
  EXPECT_EQ(loud.err.find("WILL OSCILLATE"), loud.err.rfind("WILL OSCILLATE"));
  EXPECT_EQ(loud.out.find("beyond the configured"), std::string::npos) << loud.out;
  EXPECT_EQ(run_upright(run_at("0.010", folder)).err, "");
}

TEST(ExperimentOverrunLimit, FollowsTheDelayOfEachTrial) {
  const TemporaryFolder folder;
  const fs::path file = folder.write(
      "test.yaml", "experiment:\n  name: test\n  why: a test\n  plant: " + config +
                       "plants/exponential.yaml\n  gains: " + config +
                       "gains/exponential.yaml\n  travel_m: 0.34\n  voltage_limit_v: 15\n  pieces:\n"
                       "    - {kind: delay_sweep, delay_s: [0, 0.008, 0.020], duration_s: 3, theta0_deg: 2, "
                       "start: hand}\n");
  const CommandResult result = run_upright("experiment " + file.string() + rig + " --fast --json --out " +
                                           (folder.path() / "out").string());
  const Json trials = Json::parse(result.out).at("trials");
  ASSERT_EQ(trials.size(), 3u) << result.err;
  std::vector<int> limits;
  for (const Json& trial : trials) {
    limits.push_back(limit_in(trial.at("run_directory").get<std::string>()));
    EXPECT_EQ(trial.at("most_periods_late"), limits.back());
  }
  EXPECT_EQ(limits, (std::vector<int>{14, 6, 3}));
  EXPECT_NE(result.err.find("WILL OSCILLATE OR FALL"), std::string::npos) << result.err;
}

/// A run's end, as its run.yaml has it.
std::string sentence_in(const fs::path& run) {
  const std::string text = read_text(run / "run.yaml"), key = "\n  sentence: ";
  const std::size_t at = text.find(key) + key.size();
  return text.substr(at, text.find('\n', at) - at);
}

TEST(ExperimentOverrunLimit, AFallBeyondTheMarginNamesTheDelay) {
  const TemporaryFolder folder;
  const fs::path file = folder.write(
      "test.yaml", "experiment:\n  name: test\n  why: a test\n  gains: " + config +
                       "gains/exponential.yaml\n  travel_m: 0.34\n  voltage_limit_v: 15\n  pieces:\n"
                       "    - {kind: delay_sweep, delay_s: [0, 0.1], duration_s: 3}\n");
  const CommandResult result = run_upright("experiment " + file.string() + rig + " --fast --json --out " +
                                           (folder.path() / "out").string());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json trials = Json::parse(result.out).at("trials");
  ASSERT_EQ(trials.back().at("outcome"), "fell");
  const std::string of_trial = sentence_in(trials.back().at("run_directory").get<std::string>());
  const fs::path run =
      Json::parse(run_upright(run_at("0.1", folder) + " --json").out).at("run_directory").get<std::string>();
  for (const std::string& sentence : {of_trial, sentence_in(run)})
    EXPECT_NE(sentence.find("do not stabilize this plant with this delay"), std::string::npos) << sentence;
}

}  // namespace
}  // namespace upright::testing
