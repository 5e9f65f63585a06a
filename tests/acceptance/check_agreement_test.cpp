// `upright check` with the files of one run: it refuses what `run` refuses, and names what is hard to
// believe.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "command.hpp"

namespace upright::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";
const std::string simulated = config + "rigs/simulated.yaml", rtu = config + "rigs/modbus-rtu.yaml",
                  tcp = config + "rigs/modbus-tcp.yaml", fast_gains = config + "gains/exponential.yaml",
                  serial_gains = config + "gains/exponential-200hz.yaml",
                  plant = config + "plants/exponential.yaml";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error("nothing to replace: " + from);
  return text.replace(at, from.size(), to);
}

struct Change {
  const char* name;
  std::string file, from, to;  ///< a shipped file, with one thing in it changed
  std::string beside;          ///< further files
  const char* word;            ///< of the sentence
};

CommandResult check(const Change& change, const std::string& flags = "") {
  const TemporaryFolder folder;
  std::string text = read_text(change.file);
  if (text.find("../plants/") != std::string::npos) text = replaced(text, "../plants/", config + "plants/");
  const fs::path changed =
      folder.write(fs::path(change.file).filename(), replaced(text, change.from, change.to));
  return run_upright("check " + changed.string() + " " + change.beside + flags);
}

TEST(CheckTogether, RefusesALinkThatCannotCarryTheRateAsRunDoes) {
  const CommandResult together = run_upright("check " + rtu + " " + fast_gains + " --json");
  EXPECT_EQ(together.exit_code, 2);
  EXPECT_NE(together.err.find("response_timeout_s"), std::string::npos) << together.err;
  const Json document = Json::parse(together.out);
  EXPECT_EQ(document.at("valid"), false);
  EXPECT_EQ(document.at("together").at("errors").size(), 1u);
  EXPECT_EQ(run_upright("run --unchecked --rig " + rtu + " --gains " + fast_gains).exit_code, 2);
  EXPECT_EQ(run_upright("check " + rtu + " " + serial_gains + " " + plant).exit_code, 0);
  EXPECT_EQ(run_upright("check " + tcp + " " + fast_gains).exit_code, 0);
  EXPECT_EQ(run_upright("check " + simulated + " " + fast_gains).err, "");
}

TEST(CheckTogether, RefusesALineWhoseBytesTakeLongerThanThePeriod) {
  const TemporaryFolder folder;
  const fs::path slow = folder.write(
      "slow.yaml",
      replaced(replaced(read_text(rtu), "baud: 921600", "baud: 38400"), "../plants/", config + "plants/"));
  const CommandResult together = run_upright("check " + slow.string() + " " + serial_gains);
  EXPECT_EQ(together.exit_code, 2);
  EXPECT_NE(together.err.find("baud"), std::string::npos) << together.err;
  EXPECT_EQ(run_upright("run --unchecked --rig " + slow.string() + " --gains " + serial_gains).exit_code, 2);
}

TEST(CheckTogether, RefusesASpinOfMostOfThePeriodAsRunDoes) {
  const Change spin{"", simulated, "watchdog_s:", "spin_us: 600\nwatchdog_s:", serial_gains, ""};
  EXPECT_EQ(check(spin).exit_code, 0) << "600 us of 5 ms";
  Change most = spin;
  most.beside = fast_gains;
  EXPECT_EQ(check(most).exit_code, 2);
  EXPECT_NE(check(most).err.find("spin_us"), std::string::npos);
  EXPECT_EQ(run_upright("run --rig " + simulated + " --gains " + fast_gains + " --spin 600").exit_code, 2);
}

TEST(CheckTogether, RefusesGainsThatCannotHoldThePlantAsRunDoes) {
  const Change reversed{"", fast_gains, "rad: 304.9273", "rad: -304.9273", "", ""};
  for (const std::string& beside : {simulated, plant, simulated + " " + plant}) {
    Change change = reversed;
    change.beside = beside;
    const CommandResult result = check(change);
    EXPECT_EQ(result.exit_code, 2) << beside;
    EXPECT_NE(result.err.find("do not stabilize"), std::string::npos) << result.err;
  }
}

TEST(CheckTogether, SeveralFilesOfAKindAreNotOneRun) {
  EXPECT_EQ(
      run_upright("check " + config + "rigs/*.yaml " + config + "gains/*.yaml " + config + "plants/*.yaml")
          .exit_code,
      0);
}

TEST(CheckWarns, OfWhatIsHardToBelieve) {
  const Change changes[] = {
      {"cutoff", fast_gains, "cutoff_hz: 50", "cutoff_hz: 700", "", "half the sample rate"},
      {"sign alone", fast_gains, "rad: 304.9273", "rad: -304.9273", "", "pendulum_angle_v_per_rad below 0"},
      {"delay", fast_gains, "delay_s: 0.0", "delay_s: 0.03", plant, "WILL OSCILLATE OR FALL"},
      {"watchdog", tcp, "\nwatchdog_s: 0.1", "\nwatchdog_s: 0.002", fast_gains, "one lost reply"},
      {"device's watchdog", tcp, "time_s: 0.1", "time_s: 0.002", fast_gains,
       "switch the voltage off between two requests"},
      {"grams", plant, "cart_mass_kg: 0.815", "cart_mass_kg: 815", "", "cart_mass_kg is 815"},
      {"millimetres", plant, "length_to_com_m: 0.305", "length_to_com_m: 305", "", "length_to_com_m is 305"},
      {"gravity", plant, "gravity_mps2: 9.8", "gravity_mps2: 98", "", "gravity_mps2 is 98"},
      {"track", simulated, "limit_m: 0.4", "limit_m: 40", "", "track.limit_m is 40"},
      {"short track", simulated, "limit_m: 0.4", "limit_m: 0.021", plant, "short for a pendulum"},
      {"degrees", simulated, "fall_angle_rad: 0.6", "fall_angle_rad: 2.5", "", "beyond horizontal"},
      {"weak motor", plant, "force_per_volt_n: 1.7189", "force_per_volt_n: 0.0017", simulated, "m/s2"},
  };
  for (const Change& change : changes) {
    const CommandResult result = check(change, " --json");
    EXPECT_EQ(result.exit_code, 0) << change.name << result.err;
    EXPECT_NE(result.err.find(change.word), std::string::npos) << change.name << ": " << result.err;
    const Json document = Json::parse(result.out);
    std::size_t warnings = document.at("together").at("warnings").size();
    for (const Json& file : document.at("files")) warnings += file.at("warnings").size();
    EXPECT_GE(warnings, 1u) << change.name;
  }
}

TEST(SerialGains, BalanceTheSimulatedRig) {
  const TemporaryFolder folder;
  const CommandResult result = run_upright("run --fast --theta0-deg 3 --duration 30 --rig " + simulated +
                                           " --gains " + serial_gains + " --out " + folder.path().string());
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

}  // namespace
}  // namespace upright::testing
