// `upright compare` as a user runs it.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";

class CompareCommand : public ::testing::Test {
 protected:
  fs::path run(const std::string& gains, const std::string& flags) const {
    const CommandResult result =
        run_upright("run --fast --rig " + config + "rigs/simulated.yaml --theta0-deg 3 --gains " + gains +
                    " " + flags + " --out " + folder_.path().string());
    const std::size_t end = result.out.find_last_not_of('\n');
    const std::size_t begin = result.out.rfind('\n', end) + 1;
    return result.out.substr(begin, end + 1 - begin);
  }
  std::string gains(const char* name) const { return config + "gains/" + name + ".yaml"; }
  Json compared(const std::string& runs) const {
    const CommandResult result = run_upright("compare " + runs + " --json");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(result.out);
  }

  TemporaryFolder folder_;
};

TEST_F(CompareCommand, SaysWhatDiffersInJsonInWordsAndOnAPage) {
  const fs::path a = run(gains("exponential"), "--duration 30"), b = run(gains("viscous"), "--duration 30");
  const Json document = compared(a.string() + " " + b.string());
  ASSERT_EQ(document.at("runs").size(), 2u);
  for (const Json& one : document.at("runs")) {
    for (const char* key :
         {"cart_peak_to_peak_m", "theta_peak_to_peak_rad", "voltage_rms_v", "voltage_step_rms_v"}) {
      EXPECT_GT(one.at(key).get<double>(), 0.0) << key;
      EXPECT_LE(one.at(std::string(key) + "_ci95").at(0), one.at(key));
      EXPECT_GE(one.at(std::string(key) + "_ci95").at(1), one.at(key));
    }
    EXPECT_EQ(one.at("falls"), 0);
    EXPECT_TRUE(one.at("lateness_us").is_null()) << "virtual time";
  }
  // Gain (7) chatters at 2 to 5 V and hunts by millimetres; the viscous gain hunts by more than a centimetre.
  EXPECT_NEAR(document.at("runs")[0].at("voltage_rms_v").get<double>(), 3.5, 1.5);
  EXPECT_NEAR(document.at("runs")[1].at("cart_peak_to_peak_m").get<double>(), 14e-3, 4e-3);
  EXPECT_EQ(document.at("differences")[0].at("quantity"), "cart_peak_to_peak_m");
  EXPECT_TRUE(document.at("differences")[0].at("clear"));
  const fs::path page = folder_.path() / "page.html";
  const CommandResult words =
      run_upright("compare " + a.string() + " " + b.string() + " --out " + page.string());
  EXPECT_EQ(words.exit_code, 0) << words.err;
  EXPECT_EQ(words.out.rfind("run B: ", 0), 0u) << words.out;
  EXPECT_NE(words.out.find("mm peak to peak -> "), std::string::npos) << words.out;
  const std::string html = read_text(page);
  EXPECT_NE(html.find("run B: "), std::string::npos);
  EXPECT_NE(html.find(b.filename().string()), std::string::npos);
  EXPECT_EQ(html.find("<script"), std::string::npos);
}

TEST_F(CompareCommand, ReadsFallenCutAndOtherwiseSampledRuns) {
  std::string slow = read_text(gains("exponential"));
  const std::string rate = "sample_rate_hz: 1000";
  ASSERT_NE(slow.find(rate), std::string::npos);
  slow.replace(slow.find(rate), rate.size(), "sample_rate_hz: 500");
  const fs::path a = run(gains("exponential"), "--duration 20");
  const fs::path fell = run(gains("exponential"), "--duration 20 --delay 0.4");
  const fs::path at_500 = run(folder_.write("slow.yaml", slow).string(), "--duration 20");
  const fs::path cut = run(gains("exponential"), "--duration 20");
  const std::string yaml = read_text(cut / "run.yaml");
  fs::resize_file(cut / "run.yaml", yaml.find("\noutcome:") + 1);
  fs::resize_file(cut / "samples.csv", fs::file_size(cut / "samples.csv") / 2 + 7);
  const fs::path empty = run(gains("exponential"), "--duration 1");
  const Json runs = compared(a.string() + " " + fell.string() + " " + at_500.string() + " " + cut.string() +
                             " " + empty.string())
                        .at("runs");
  ASSERT_EQ(runs.size(), 5u);
  EXPECT_EQ(runs[1].at("falls"), 1);
  EXPECT_TRUE(runs[1].at("voltage_rms_v").is_null()) << "it fell within a second";
  EXPECT_EQ(runs[2].at("sample_rate_hz"), 500.0);
  EXPECT_GT(runs[2].at("voltage_step_rms_v").get<double>(), 0.0);
  EXPECT_EQ(runs[3].at("result"), "cut_short");
  EXPECT_GT(runs[3].at("voltage_rms_v").get<double>(), 0.0);
  EXPECT_TRUE(runs[4].at("voltage_rms_v").is_null());
  EXPECT_FALSE(runs[4].at("problem").is_null());
  const CommandResult words =
      run_upright("compare " + a.string() + " " + fell.string() + " " + at_500.string() + " --out " +
                  (folder_.path() / "page.html").string());
  EXPECT_EQ(words.exit_code, 0) << words.err;
  EXPECT_EQ(words.out.rfind("run B: fell after ", 0), 0u) << words.out;
  EXPECT_NE(words.out.find("run C: sampled at 500 Hz"), std::string::npos) << words.out;
}

TEST_F(CompareCommand, RefusesWhatIsNoRun) {
  for (const std::string& arguments :
       {std::string(), folder_.path().string(), (folder_.path() / "none").string()}) {
    const CommandResult result = run_upright("compare " + arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_FALSE(result.err.empty());
  }
}

}  // namespace
}  // namespace upright::testing
