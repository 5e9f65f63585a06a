// The README's demonstration and what bad data are answered with, through the command line.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "command.hpp"

namespace upright::testing {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

const std::string source = UPRIGHT_SOURCE_DIR;

class Diagnose : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("upright_diagnose_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string in_folder(const std::string& name) const { return (folder_ / name).string(); }
  /// Records a run that is not among those of the README.
  std::string recorded_run(const std::string& gains, const std::string& theta0_deg,
                           const std::string& delay_s) const {
    const CommandResult result =
        run_upright("run --rig " + source + "/config/rigs/simulated.yaml --gains " + source +
                    "/config/gains/" + gains + ".yaml --fast --theta0-deg " + theta0_deg + " --delay " +
                    delay_s + " --duration 6 --out " + in_folder("unseen"));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return fs::directory_iterator(folder_ / "unseen")->path().string();
  }
  /// Records the runs of the README's demonstration; the command that diagnoses them.
  std::string diagnose_recorded() const {
    struct Run {
      const char *gains, *theta0_deg, *delay_s;
    };
    const Run runs[] = {{"viscous", "6", "0"}, {"exponential", "5", "0.018"}, {"exponential", "6", "0.021"}};
    for (const Run& run : runs) {
      const CommandResult result =
          run_upright("run --rig " + source + "/config/rigs/simulated.yaml --gains " + source +
                      "/config/gains/" + run.gains + ".yaml --fast --theta0-deg " + run.theta0_deg +
                      " --delay " + run.delay_s + " --duration 6 --out " + in_folder("runs"));
      EXPECT_EQ(result.exit_code, 0) << result.err;
    }
    std::set<std::string> recorded;
    for (const auto& entry : fs::directory_iterator(folder_ / "runs")) recorded.insert(entry.path().string());
    std::string command = "diagnose --model " + source + "/config/plants/viscous.yaml --data";
    for (const std::string& run : recorded) command.append(" ").append(run);
    return command;
  }
  fs::path folder_;
};

TEST_F(Diagnose, NamesCoulombAndStribeckInThePapersOwnCase) {
  const std::string command = diagnose_recorded();
  const std::string unseen = recorded_run("exponential", "4", "0.02");
  const CommandResult result =
      run_upright(command + " --validate " + unseen + " --out " + in_folder("out") + " --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json d = Json::parse(result.out);
  EXPECT_EQ(d, Json::parse(std::ifstream(folder_ / "out" / "diagnosis.json")));
  std::set<std::string> kinds;
  for (const Json& effect : d.at("effects")) kinds.insert(effect.at("kind"));
  EXPECT_TRUE(kinds.contains("coulomb_friction")) << result.out;
  EXPECT_TRUE(kinds.contains("stribeck_friction")) << result.out;
  EXPECT_EQ(d.at("verdict"), "explained");
  EXPECT_GT(d.at("gap").at("before"), 5.0);
  EXPECT_LT(d.at("gap").at("after"), 1.1);
  double gap = d.at("gap").at("before");
  for (const Json& effect : d.at("effects")) {
    EXPECT_EQ(effect.at("gap_before"), gap) << "the gap of the effects before it";
    EXPECT_LE(effect.at("gap_after"), gap) << effect.at("kind") << " raises the gap";
    EXPECT_EQ(effect.at("shown_on").size(), 3u);
    gap = effect.at("gap_after");
  }
  EXPECT_EQ(gap, d.at("gap").at("after"));
  EXPECT_GE(gap, 1.0);
  EXPECT_TRUE(d.at("helps_here_only").empty());
  EXPECT_FALSE(d.at("detectable").empty());
  ASSERT_EQ(d.at("validation").size(), 1u);
  EXPECT_LT(d.at("validation")[0].at("found").at("gap"),
            0.2 * d.at("validation")[0].at("given").at("gap").get<double>());
  EXPECT_FALSE(d.at("validation")[0].at("found_is_worse"));
  ASSERT_FALSE(d.at("measured_range").empty());
  EXPECT_EQ(d.at("measured_range")[0].at("quantity"), "cart_m");
  EXPECT_LT(d.at("measured_range")[0].at("low"), d.at("measured_range")[0].at("high"));
  EXPECT_EQ(run_upright("check " + in_folder("out/model.yaml")).exit_code, 0);
  std::ostringstream model;
  model << std::ifstream(folder_ / "out" / "model.yaml").rdbuf();
  for (const Json& effect : d.at("effects"))
    for (const auto& [name, parameter] : effect.at("parameters").items()) {
      const std::string number = effect.at("kind").get<std::string>() + "." + name;
      EXPECT_NE(model.str().find("- {number: \"" + number + "\", low: "), std::string::npos) << number;
    }
  EXPECT_EQ(run_upright("report " + in_folder("out")).exit_code, 0);
  std::ostringstream page;
  page << std::ifstream(folder_ / "out" / "report.html").rdbuf();
  // The simulated traces, and the plant file's new line.
  EXPECT_NE(page.str().find("Measurement and simulation of held-out data"), std::string::npos);
  EXPECT_NE(page.str().find("+     - {kind: coulomb_friction"), std::string::npos);
  EXPECT_EQ(run_upright(command + " --out " + in_folder("out")).exit_code, 2) << "never written over";
}

TEST_F(Diagnose, QuicklyNamesOnlyWhatTheCompleteAnswerNames) {
  const std::string command = diagnose_recorded();
  const CommandResult quick = run_upright(command + " --json --quick");
  const CommandResult complete = run_upright(command + " --json");
  ASSERT_EQ(quick.exit_code, 0) << quick.err;
  ASSERT_EQ(complete.exit_code, 0) << complete.err;
  const Json d = Json::parse(quick.out), whole = Json::parse(complete.out);
  EXPECT_TRUE(d.at("quick"));
  EXPECT_FALSE(d.at("not_examined").empty());
  EXPECT_FALSE(whole.contains("quick"));
  std::set<std::string> named;
  for (const Json& effect : whole.at("effects")) named.insert(effect.at("kind"));
  // Three short runs of two effects bear none out alone: it is listed as not certain enough.
  std::set<std::string> seen;
  for (const char* list : {"effects", "helps_here_only"})
    for (const Json& effect : d.at(list)) seen.insert(effect.at("kind"));
  EXPECT_FALSE(seen.empty()) << quick.out;
  for (const std::string& kind : seen) EXPECT_TRUE(named.contains(kind)) << kind;
  EXPECT_NE(d.at("verdict"), "no_discrepancy");
  EXPECT_EQ(run_upright(command + " --quick").out.find("QUICK: only what is certain"), 0u);
}

TEST_F(Diagnose, SaysTheSameHoweverManyCoresThereAre) {
  const std::string command = diagnose_recorded() + " --json --out ";
  std::set<std::string> said;
  for (const char* threads : {"1", "3"}) {
    setenv("UPRIGHT_THREADS", threads, 1);
    const CommandResult result = run_upright(command + in_folder(std::string("on_") + threads));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    said.insert(result.out);
  }
  unsetenv("UPRIGHT_THREADS");
  EXPECT_EQ(said.size(), 1u) << ::testing::PrintToString(said);
}

TEST_F(Diagnose, RefusesDataThatSayNothing) {
  const std::string model = "diagnose --model " + source + "/config/plants/viscous.yaml --data ";
  std::ofstream(folder_ / "columns.csv") << "t,x\n0,1\n";
  std::ofstream(folder_ / "short.csv") << "time_s,cart_m,voltage_v\n0,0,0\n";
  std::ofstream still(folder_ / "still.csv");
  still << "time_s,cart_m,voltage_v\n";
  for (int k = 0; k < 50; ++k) still << 0.01 * k << ",0.1,0\n";
  still.close();
  for (const char* name : {"columns.csv", "short.csv", "still.csv", "missing.csv"}) {
    const CommandResult result = run_upright(model + in_folder(name));
    EXPECT_EQ(result.exit_code, 2) << name;
    EXPECT_NE(result.err.find(name), std::string::npos) << result.err;
  }
}

}  // namespace
}  // namespace upright::testing
