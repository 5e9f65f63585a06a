// What `upright run` refuses to start: a rig whose signs nobody checked, and gains that cannot hold the
// plant; the latter `upright experiment` too.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error("nothing to replace: " + from);
  return text.replace(at, from.size(), to);
}

/// A simulated rig with one effect more.
fs::path rig_with(const TemporaryFolder& folder, const std::string& effect) {
  folder.write("plant.yaml", replaced(read_text(config + "plants/exponential.yaml"), "effects:\n",
                                      "effects:\n    - " + effect));
  return folder.write("rig.yaml", replaced(read_text(config + "rigs/simulated.yaml"),
                                           "../plants/exponential.yaml", "plant.yaml"));
}

std::string run_line(const fs::path& rig, const fs::path& gains, const TemporaryFolder& folder) {
  return "run --rig " + rig.string() + " --gains " + gains.string() + " --duration 2 --out " +
         (folder.path() / "runs").string() + " ";
}

TEST(RunRefuses, ARealRigWhoseSignsWereNotChecked) {
  const TemporaryFolder folder;
  // Nobody listens there: a run that is not refused finds out, and ends with another exit code.
  const fs::path rig =
      folder.write("rig.yaml", replaced(read_text(config + "rigs/modbus-tcp.yaml"), "port: 1502", "port: 1"));
  const fs::path gains = folder.write(
      "gains.yaml", replaced(read_text(config + "gains/exponential.yaml"), "rate_hz: 1000", "rate_hz: 500"));
  const CommandResult refused = run_upright(run_line(rig, gains, folder));
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_NE(refused.err.find("sign-check.yaml"), std::string::npos) << refused.err;
  EXPECT_NE(refused.err.find("--unchecked"), std::string::npos) << refused.err;
  EXPECT_EQ(run_upright(run_line(rig, gains, folder) + "--unchecked").exit_code, 4);
}

TEST(RunRefuses, GainsThatCannotStabilizeThePlant) {
  const std::string text = read_text(config + "gains/exponential.yaml");
  const fs::path rig = config + "rigs/simulated.yaml";
  for (const auto& [from, to] :
       {std::pair{"rad: 304.9273", "rad: -304.9273"}, std::pair{"rad: 304.9273", "rad: 10"},
        std::pair{"mps: 143.3152", "mps: -143.3152"}, std::pair{"m: 70.7107", "m: -70.7107"}}) {
    const TemporaryFolder folder;
    const fs::path gains = folder.write("gains.yaml", replaced(text, from, to));
    const CommandResult refused = run_upright(run_line(rig, gains, folder) + "--fast");
    EXPECT_EQ(refused.exit_code, 2) << to << refused.err;
    EXPECT_NE(refused.err.find("--force"), std::string::npos) << refused.err;
    EXPECT_FALSE(fs::exists(folder.path() / "runs"));
    const CommandResult forced = run_upright(run_line(rig, gains, folder) + "--fast --force --json");
    EXPECT_NE(forced.exit_code, 2) << forced.err;
    EXPECT_EQ(Json::parse(forced.out).at("delay_margin").at("stabilized"), false);
  }
}

TEST(ExperimentRefuses, GainsThatCannotStabilizeThePlant) {
  const TemporaryFolder folder;
  const fs::path gains = folder.write("gains.yaml", replaced(read_text(config + "gains/exponential.yaml"),
                                                             "rad: 304.9273", "rad: -304.9273"));
  const auto line = [&](const std::string& piece) {
    const fs::path file = folder.write(
        "test.yaml", "experiment:\n  name: test\n  why: a test\n  gains: " + gains.string() +
                         "\n  travel_m: 0.3\n  voltage_limit_v: 10\n  pieces:\n    - " + piece + "\n");
    return "experiment " + file.string() + " --rig " + config + "rigs/simulated.yaml --dry-run";
  };
  const std::string balance = line("{kind: closed_loop, set_points_m: [0], hold_s: 2}");
  const CommandResult refused = run_upright(balance);
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_NE(refused.err.find("do not stabilize the plant"), std::string::npos) << refused.err;
  EXPECT_NE(refused.err.find("--force"), std::string::npos) << refused.err;
  // With --force its rehearsal decides.
  const CommandResult forced = run_upright(balance + " --force");
  EXPECT_EQ(forced.exit_code, 2) << forced.err;
  EXPECT_NE(forced.err.find("would fall"), std::string::npos) << forced.err;
  // Where nothing balances, the gains do not matter.
  EXPECT_EQ(run_upright(line("{kind: observe, duration_s: 1}")).exit_code, 0);
}

TEST(RunRefuses, NoDelayHoweverLong) {
  const TemporaryFolder folder;
  const fs::path gains = config + "gains/exponential.yaml";
  const fs::path own = rig_with(folder, "{kind: input_delay, delay_s: 0.02}\n");
  for (const std::string& line : {run_line(config + "rigs/simulated.yaml", gains, folder) + "--delay 0.2",
                                  run_line(own, gains, folder)}) {
    const CommandResult result = run_upright(line + " --fast");
    EXPECT_NE(result.exit_code, 2) << result.err;
    EXPECT_NE(result.err.find("WILL OSCILLATE OR FALL"), std::string::npos) << result.err;
  }
}

TEST(RunRefuses, NothingForCoggingThatFrictionAndMotionOutweigh) {
  const TemporaryFolder folder;
  const fs::path rig =
      rig_with(folder, "{kind: cogging_force, amplitude_n: 2, pitch_m: 0.02, phase_rad: 3.14159}\n");
  const CommandResult result =
      run_upright(run_line(rig, config + "gains/exponential.yaml", folder) + "--fast --theta0-deg 3");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
}

}  // namespace
}  // namespace upright::testing
