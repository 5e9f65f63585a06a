// `upright doctor` as a user runs it: alone, and on a rig behind a link.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "../integration/virtual_rig_process.hpp"
#include "command.hpp"

namespace upright::testing {
namespace {

using Json = nlohmann::json;
using test::Folder;
using test::replaced;
using test::text_of;
using test::VirtualRigProcess;

const std::string rigs = UPRIGHT_SOURCE_DIR "/config/rigs/";

Json parsed(const CommandResult& result) {
  return Json::parse(result.out);
}

const Json& about(const Json& document, const std::string& subject) {
  for (const Json& finding : document.at("findings"))
    if (finding.at("subject") == subject) return finding;
  throw std::runtime_error("nothing about " + subject);
}

/// A doctor's page on a virtual rig: the arguments and the rig file differ, the motor stays off.
struct Visit {
  CommandResult result;
  std::vector<test::TraceRow> trace;
};

Visit visit(const std::vector<std::string>& virtual_flags, const std::string& arguments,
            const std::string& from = "sign", const std::string& to = "sign") {
  const Folder folder;
  const std::string rig =
      replaced(text_of(rigs + "modbus-tcp.yaml"), "response_timeout_s: 0.0008", "response_timeout_s: 0.004");
  VirtualRigProcess server(folder, rig, false, virtual_flags);
  const std::filesystem::path file = folder / "rig.yaml";
  std::ofstream(file) << replaced(replaced(rig, "port: 1502", "port: " + std::to_string(server.port())), from,
                                  to);
  Visit visit;
  visit.result =
      run_upright("doctor --seconds 0.5 --rate 100 --rig " + shell_quoted(file.string()) + " " + arguments);
  server.end();
  visit.trace = server.trace();
  return visit;
}

TEST(Doctor, SaysOnOnePageWhatTheMachineIsGoodFor) {
  const CommandResult result = run_upright("doctor --seconds 0.2");
  EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 4) << result.err;
  for (const char* subject : {"kernel", "processors", "governor", "sleep states", "rtprio", "memlock",
                              "scheduling", "wake-ups, idle", "wake-ups, loaded"})
    EXPECT_NE(result.out.find(subject), std::string::npos) << subject << "\n" << result.out;
  EXPECT_NE(result.out.find("Verdict: "), std::string::npos);
  EXPECT_NE(result.out.find("late, idle"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find(" us to "), std::string::npos) << "histograms: " << result.out;
  EXPECT_LT(std::count(result.out.begin(), result.out.end(), '\n'), 50);
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);)
    if (line.find('#') != std::string::npos) {
      EXPECT_LE(line.size(), 100u) << line;
    }
}

TEST(Doctor, PrintsTheCommandsThatRepairAMachine) {
  const CommandResult result = run_upright("doctor --fix");
  EXPECT_EQ(result.exit_code, 0);
  // A shell must understand each line.
  EXPECT_EQ(run_shell("bash -n <<'SCRIPT'\n" + result.out + "SCRIPT\n").exit_code, 0) << result.out;
  EXPECT_EQ(run_upright("doctor --fix --json").exit_code, 2);
}

TEST(Doctor, GivesOneDocumentWhoseVerdictFollowsFromItsFindings) {
  const CommandResult result = run_upright("doctor --seconds 0.2 --rate 200 --json");
  const Json document = parsed(result);
  std::string worst = "good";
  for (const Json& finding : document.at("findings")) {
    const std::string health = finding.at("health");
    if (health == "poor" && worst == "good") worst = health;
    if (health == "bad") worst = health;
    if (health != "good") {
      EXPECT_FALSE(finding.at("remedy").is_null()) << finding.dump();
    }
  }
  EXPECT_EQ(document.at("verdict"), worst);
  EXPECT_EQ(result.exit_code, worst == "bad" ? 4 : 0);
  EXPECT_EQ(document.at("rate_hz"), 200.0);
  EXPECT_TRUE(document.at("link").is_null());
  for (const char* wake : {"wake_late_idle", "wake_late_loaded"}) {
    EXPECT_GT(document.at(wake).at("count"), 0);
    EXPECT_LE(document.at(wake).at("p50_us"), document.at(wake).at("max_us"));
    EXPECT_EQ(document.at(wake).at("histogram_upper_us").size(),
              document.at(wake).at("histogram_count").size());
  }
}

TEST(Doctor, MeasuresTheLinkAndFindsTheHangingPendulum) {
  const Visit v = visit({"--theta0-deg", "180"}, "--json");
  const Json document = parsed(v.result);
  ASSERT_FALSE(document.at("link").is_null());
  EXPECT_GT(document.at("link").at("count"), 10);
  EXPECT_GT(document.at("link").at("highest_rate_hz"), 0.0);
  EXPECT_LE(document.at("link").at("p50_us"), document.at("link").at("p99_9_us"));
  EXPECT_EQ(about(document, "zero").at("health"), "good") << v.result.out;
  EXPECT_EQ(about(document, "encoder signs").at("health"), "not examined");
  EXPECT_EQ(about(document, "emergency stop").at("what"), "no emergency stop is wired");
  EXPECT_EQ(about(document, "limit switches").at("health"), "not examined");
  ASSERT_FALSE(v.trace.empty());
  for (const test::TraceRow& row : v.trace) {
    EXPECT_EQ(row.voltage_v, 0.0);
    EXPECT_TRUE(row.held) << "the amplifier was never enabled";
  }
}

TEST(Doctor, GivesTheCountsToPutInWhenTheZeroIsWrong) {
  const Visit v = visit({"--theta0-deg", "150"}, "--json");
  const Json zero = about(parsed(v.result), "zero");
  EXPECT_EQ(zero.at("health"), "poor");
  EXPECT_NE(zero.at("remedy").get<std::string>().find("pendulum_counts: 1707, pose: hanging"),
            std::string::npos)
      << zero.dump();
}

/// Somebody lifts the hanging pendulum over the side of +x.
TEST(Doctor, ChecksThePendulumsSignByHand) {
  const std::string arguments = "--json --by-hand --hand-wait 3";
  const std::vector<std::string> lifted = {"--hang", "4", "--theta0-deg", "2"};
  const Visit right = visit(lifted, arguments);
  EXPECT_EQ(about(parsed(right.result), "cart's sign").at("health"), "not examined") << "nobody pushed it";
  EXPECT_EQ(about(parsed(right.result), "pendulum's sign").at("health"), "good");
  const Visit wrong = visit(lifted, arguments, "revolution: 4096, sign: 1", "revolution: 4096, sign: -1");
  EXPECT_EQ(about(parsed(wrong.result), "pendulum's sign").at("health"), "bad");
  EXPECT_EQ(wrong.result.exit_code, 4);
}

TEST(Doctor, SaysWhyItCannotLookAtTheLinesOfASimulatedRig) {
  const Folder folder;
  const std::filesystem::path file = folder / "rig.yaml";
  std::ofstream(file) << replaced(text_of(rigs + "simulated.yaml"), "../plants",
                                  UPRIGHT_SOURCE_DIR "/config/plants")
                      << "gpio:\n  chip: no-such-chip\n  emergency_stop: {line: 0, active: high}\n";
  const CommandResult result =
      run_upright("doctor --seconds 0.1 --json --rig " + shell_quoted(file.string()));
  EXPECT_EQ(result.exit_code, 4) << result.err;
  const Json lines = about(parsed(result), "digital lines");
  EXPECT_EQ(lines.at("health"), "bad");
  EXPECT_NE(lines.at("remedy").get<std::string>().find("gpiodetect"), std::string::npos) << lines.dump();
}

TEST(Doctor, RefusesARigThatIsNotThereAndAFileThatIsNone) {
  const Folder folder;
  std::ofstream(folder / "rig.yaml") << replaced(text_of(rigs + "modbus-tcp.yaml"), "port: 1502", "port: 1");
  const CommandResult nobody =
      run_upright("doctor --seconds 0.1 --rig " + shell_quoted((folder / "rig.yaml").string()));
  EXPECT_EQ(nobody.exit_code, 4) << nobody.err;
  EXPECT_NE(nobody.err.find("127.0.0.1:1"), std::string::npos) << nobody.err;
  EXPECT_EQ(run_upright("doctor --seconds 0.1 --rig /no/such/rig.yaml").exit_code, 2);
  EXPECT_EQ(run_upright("doctor --seconds 0").exit_code, 2);
}

}  // namespace
}  // namespace upright::testing
