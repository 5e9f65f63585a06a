// An experiment in which controllers take turns, A, B, A, B, and its comparison. Samples and files are the
// witnesses.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";

class ControllersInTurns : public ::testing::Test {
 protected:
  fs::path file(const std::string& gains, const std::string& more) const {
    return folder_.write(
        "test.yaml", "experiment:\n  name: test\n  why: a test\n  plant: " + config +
                         "plants/exponential.yaml\n  travel_m: 0.34\n  voltage_limit_v: 15\n  pieces:\n"
                         "    - {kind: closed_loop, label: turns, set_points_m: [0], hold_s: 15, gains: {" +
                         gains + "}, " + more + "}\n");
  }
  std::string gains(const char* name) const { return config + "gains/" + name + ".yaml"; }
  CommandResult experiment(const fs::path& file, const std::string& flags,
                           const std::string& rig = config + "rigs/simulated.yaml") const {
    return run_upright("experiment " + file.string() + " --rig " + rig + " --fast --out " + out_.string() +
                       " " + flags);
  }
  /// Cells of trials.csv, a row each, without its header.
  std::vector<std::vector<std::string>> trials() const {
    std::vector<std::vector<std::string>> rows;
    std::stringstream in(read_text(out_ / "trials.csv"));
    std::string line, cell;
    for (std::getline(in, line); std::getline(in, line);) {
      rows.emplace_back();
      for (std::stringstream cells(line); std::getline(cells, cell, ',');) rows.back().push_back(cell);
    }
    return rows;
  }
  std::vector<std::string> column(std::size_t number) const {
    std::vector<std::string> cells;
    for (const auto& row : trials()) cells.push_back(row.at(number));
    return cells;
  }

  TemporaryFolder folder_;
  fs::path out_ = folder_.path() / "out";
};
constexpr std::size_t directory_column = 4, outcome_column = 6, theta0_column = 7, controller_column = 12,
                      gains_column = 13;

TEST_F(ControllersInTurns, StartAlikeReplayAndAreComparedInPairs) {
  const fs::path experiment_file = file("seven: " + gains("exponential") + ", quiet: " + gains("quiet"),
                                        "repeats: 3, theta0_deg: [1, 2, 3]");
  const CommandResult result = experiment(experiment_file, "--json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(column(controller_column),
            (std::vector<std::string>{"seven", "quiet", "seven", "quiet", "seven", "quiet"}));
  EXPECT_EQ(column(gains_column)[1], gains("quiet"));
  const std::vector<std::string> starts = column(theta0_column);
  for (std::size_t i = 0; i < starts.size(); i += 2) EXPECT_EQ(starts[i], starts[i + 1]) << "round " << i / 2;
  EXPECT_NE(starts[0], starts[2]);
  for (const std::string& run : column(directory_column)) {
    EXPECT_EQ(run_upright("replay " + (out_ / run).string()).exit_code, 0) << run;
    const bool is_quiet = run.find("-turns-quiet-") != std::string::npos;
    EXPECT_EQ(read_text(out_ / run / "run.yaml").find("state_estimator:") != std::string::npos, is_quiet)
        << run;
  }
  // Late periods are limited by what each loop bears: gain (7) less than the quiet one.
  const Json made = Json::parse(result.out).at("trials");
  for (const Json& trial : made) {
    const std::string text = read_text(fs::path(trial.at("run_directory").get<std::string>()) / "run.yaml");
    EXPECT_NE(text.find("most_periods_late: " + trial.at("most_periods_late").dump() + "\n"),
              std::string::npos);
  }
  EXPECT_LT(made[0].at("most_periods_late"), made[1].at("most_periods_late"));
  const CommandResult compared = run_upright("compare " + out_.string() + " --json");
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  const Json comparison = Json::parse(compared.out).at("pieces").at(0).at("comparisons").at(0);
  EXPECT_EQ(comparison.at("controller"), "quiet");
  EXPECT_EQ(comparison.at("against"), "seven");
  EXPECT_EQ(comparison.at("rounds"), 3);
  for (const Json& difference : comparison.at("differences")) {
    EXPECT_NEAR(difference.at("difference").get<double>(),
                difference.at("to").get<double>() - difference.at("from").get<double>(), 1e-12);
    if (difference.at("quantity") != "voltage_rms_v") continue;
    // docs/results/quiet-control.md: 2.8 V rms with gain (7), 0.7 V with the quiet controller.
    EXPECT_LT(difference.at("difference_ci95").at(1).get<double>(), -0.5);
    EXPECT_TRUE(difference.at("clear"));
  }
  const CommandResult words =
      run_upright("compare " + out_.string() + " --out " + (folder_.path() / "page.html").string());
  EXPECT_EQ(words.exit_code, 0) << words.err;
  EXPECT_NE(words.out.find("quiet against seven, 3 rounds: "), std::string::npos) << words.out;
  EXPECT_EQ(run_upright("report " + out_.string()).exit_code, 0);
  for (const fs::path& page : {folder_.path() / "page.html", out_ / "report.html"})
    EXPECT_NE(read_text(page).find("paired t-test"), std::string::npos) << page;
  EXPECT_EQ(
      run_upright("compare " + out_.string() + " " + (out_ / column(directory_column)[0]).string()).exit_code,
      2);
}

TEST_F(ControllersInTurns, GoOnAfterAStopAndNotWithOtherGains) {
  const fs::path own = folder_.write("own.yaml", read_text(gains("viscous")));
  const fs::path experiment_file =
      file("seven: " + gains("exponential") + ", own: " + own.string(), "repeats: 2");
  ASSERT_EQ(experiment(experiment_file, "").exit_code, 0);
  // As if the power had gone in the third run.
  const std::string journal = read_text(out_ / "trials.csv");
  std::size_t end = 0;
  for (int line = 0; line < 3; ++line) end = journal.find('\n', end) + 1;
  const auto cut = [&] { std::ofstream(out_ / "trials.csv", std::ios::binary) << journal.substr(0, end); };
  cut();
  const CommandResult second = experiment(experiment_file, "--json");
  ASSERT_EQ(second.exit_code, 0) << second.err;
  EXPECT_EQ(Json::parse(second.out).at("made"), 2);
  EXPECT_EQ(column(controller_column), (std::vector<std::string>{"seven", "own", "seven", "own"}));
  cut();
  std::string other = read_text(own);
  other.replace(other.find("cutoff_hz: 50"), 13, "cutoff_hz: 60");
  std::ofstream(own, std::ios::binary) << other;
  const CommandResult refused = experiment(experiment_file, "");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("another experiment"), std::string::npos) << refused.err;
}

TEST_F(ControllersInTurns, AFallIsAResult) {
  // The plan does not know the actuator's delay, which gain (7) does not bear and the viscous gain does.
  std::string plant = read_text(config + "plants/exponential.yaml");
  folder_.write("plant.yaml", plant + "    - {kind: input_delay, delay_s: 0.028}\n");
  std::string rig = read_text(config + "rigs/simulated.yaml");
  const std::string named = "../plants/exponential.yaml";
  const fs::path late = folder_.write("rig.yaml", rig.replace(rig.find(named), named.size(), "plant.yaml") +
                                                      "encoder_watch: {largest_lag_s: 0.06}\n");
  const CommandResult result =
      experiment(file("slow: " + gains("viscous") + ", seven: " + gains("exponential"), "repeats: 2"),
                 "--plant " + config + "plants/exponential.yaml --json", late.string());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(Json::parse(result.out).at("complete"));
  EXPECT_EQ(column(outcome_column), (std::vector<std::string>{"done", "fell", "done", "fell"}));
  const Json comparison = Json::parse(run_upright("compare " + out_.string() + " --json").out)
                              .at("pieces")
                              .at(0)
                              .at("comparisons")
                              .at(0);
  EXPECT_EQ(comparison.at("falls"), 2);
  EXPECT_EQ(comparison.at("rounds"), 0);
}

TEST_F(ControllersInTurns, AreRefusedBeforeAnythingMoves) {
  std::string unstable = read_text(gains("exponential"));
  unstable.replace(unstable.find("rad: 304.9273"), 13, "rad: -304.927");
  const std::string seven = "a: " + gains("exponential"), b = ", b: " + gains("viscous");
  struct Case {
    std::string gains, more, says;
  };
  const Case cases[] = {
      {seven, "repeats: 2", "2 to 8"},
      {seven + ", b: " + gains("exponential-200hz"), "repeats: 2", "sample_rate_hz"},
      {seven + ", b: " + folder_.write("u.yaml", unstable).string(), "repeats: 2", "u.yaml do not stabilize"},
      {seven + ", B/: " + gains("viscous"), "repeats: 2", "is not a valid name for a controller"},
      {seven + ", b: " + (folder_.path() / "none.yaml").string(), "repeats: 2", "none.yaml"},
      {seven + b, "repeats: 0", "repeats"},
      {seven + b, "theta0_deg: [1, 9]", "theta0_deg"},
      {seven + b, "delay_s: 0.03", "with the gains a would fall"},
  };
  for (const Case& one : cases) {
    const CommandResult result = experiment(file(one.gains, one.more), "");
    EXPECT_EQ(result.exit_code, 2) << one.says << result.err;
    EXPECT_NE(result.err.find(one.says), std::string::npos) << one.says << ": " << result.err;
    EXPECT_FALSE(fs::exists(out_)) << one.says;
  }
}

}  // namespace
}  // namespace upright::testing
