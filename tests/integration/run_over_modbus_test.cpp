// `upright run` over the real links against the virtual rig: it balances without a fault; with faults it goes
// on or is at zero volts within the watchdog's time, seen from the plant's side, and the log says which cycle
// was the first.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <thread>

#include "virtual_rig_process.hpp"

namespace upright::test {
namespace {

const std::string config = UPRIGHT_SOURCE_DIR "/config/";

/// Seconds each run lasts; UPRIGHT_LONG=1 makes them the 30 s that the rig must hold.
std::string duration() {
  return std::getenv("UPRIGHT_LONG") != nullptr ? "30" : "5";
}

struct Outcome {
  int exit_code = -1;
  std::string said;
  std::string run_yaml, samples;
  std::vector<TraceRow> trace;
};

struct Case {
  const char* name;
  bool serial;
  std::vector<std::string> flags;
};

Outcome run(const Case& c) {
  Folder folder;
  std::string rig = text_of(config + "rigs/" + (c.serial ? "modbus-rtu.yaml" : "modbus-tcp.yaml"));
  VirtualRigProcess server(folder, rig, c.serial, c.flags);
  rig = c.serial ? replaced(rig, "/dev/ttyUSB0", server.name())
                 : replaced(rig, "port: 1502", "port: " + std::to_string(server.port()));
  std::ofstream(folder / "rig.yaml") << rig;
  std::ofstream(folder / "gains.yaml")
      << replaced(text_of(config + "gains/exponential.yaml"), "sample_rate_hz: 1000",
                  c.serial ? "sample_rate_hz: 200" : "sample_rate_hz: 500");
  Process client({UPRIGHT_BINARY, "run", "--rig", folder / "rig.yaml", "--gains", folder / "gains.yaml",
                  "--duration", duration(), "--out", folder / "run", "--json"});
  Outcome outcome;
  outcome.said = client.rest();
  outcome.exit_code = client.wait();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  server.end();
  outcome.trace = server.trace();
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "run")) {
    if (entry.path().filename() == "run.yaml") outcome.run_yaml = text_of(entry.path());
    if (entry.path().filename() == "samples.csv") outcome.samples = text_of(entry.path());
  }
  return outcome;
}

/// time_s of the last row of samples.
double last_sample_s(const std::string& samples) {
  const std::size_t end = samples.find_last_not_of('\n');
  const std::string row = samples.substr(samples.rfind('\n', end) + 1);
  return std::stod(row.substr(row.find(',') + 1));
}

class RunOverModbus : public testing::TestWithParam<Case> {};

TEST_P(RunOverModbus, BalancesOrStopsAtZeroVolts) {
  const Outcome outcome = run(GetParam());
  ASSERT_FALSE(outcome.trace.empty());
  EXPECT_FALSE(outcome.samples.empty());
  EXPECT_EQ(outcome.trace.back().voltage_v, 0.0) << "the motor is off in the end";
  const bool faulty = !GetParam().flags.empty();
  if (!faulty) {
    EXPECT_EQ(outcome.exit_code, 0) << outcome.said << outcome.run_yaml;
  }
  double let_go_s = 0.0, on_until_s = 0.0;
  for (const TraceRow& row : outcome.trace) {
    if (row.held && on_until_s == 0.0) let_go_s = row.time_s;
    if (row.voltage_v != 0.0) on_until_s = row.time_s;
  }
  constexpr double watchdog_s = 0.1, margin_s = 0.05;
  EXPECT_LT(on_until_s - let_go_s, last_sample_s(outcome.samples) + watchdog_s + margin_s);
  if (outcome.exit_code == 0) {
    EXPECT_GT(on_until_s - let_go_s, 0.9 * std::stod(duration()));
    return;
  }
  // A stop: a whole report that names its cycle, with the samples kept.
  EXPECT_TRUE(outcome.exit_code == 3 || outcome.exit_code == 4) << outcome.said << outcome.run_yaml;
  EXPECT_NE(outcome.run_yaml.find("tick"), std::string::npos) << outcome.run_yaml;
  if (std::string(GetParam().name).find("restart") != std::string::npos) {
    EXPECT_NE(outcome.run_yaml.find("restarted"), std::string::npos) << outcome.run_yaml;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Links, RunOverModbus,
    testing::Values(Case{"tcp", false, {}}, Case{"rtu", true, {}},
                    Case{"tcp_late", false, {"--inject-late-every", "300", "--inject-late-ms", "5"}},
                    Case{"rtu_late", true, {"--inject-late-every", "300", "--inject-late-ms", "5"}},
                    Case{"tcp_drop", false, {"--inject-drop-every", "300"}},
                    Case{"rtu_drop", true, {"--inject-drop-every", "300"}},
                    Case{"tcp_corrupt", false, {"--inject-corrupt-every", "300"}},
                    Case{"rtu_corrupt", true, {"--inject-corrupt-every", "300"}},
                    Case{"tcp_restart", false, {"--inject-restart-after", "2"}},
                    Case{"rtu_restart", true, {"--inject-restart-after", "2"}}),
    [](const auto& item) { return std::string(item.param.name); });

}  // namespace
}  // namespace upright::test
