// `upright run` and its end, against a device of the tests' own: what it says of zero volts, on the terminal,
// in run.yaml, in JSON and in the report, and with which exit code; which signals end it; what a busy device
// and a stall come to. Judged by the device's record.
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>

#include "fake_device.hpp"
#include "upright/record/replay.hpp"
#include "upright/record/run_reader.hpp"
#include "virtual_rig_process.hpp"

namespace upright::test {
namespace {

using namespace std::chrono_literals;

constexpr double for_good_s = 60.0, watchdog_s = 0.1;

/// A run that has begun to drive a device.
class StopRun : public testing::Test {
 protected:
  void start(bool serial, bool has_watchdog, std::vector<std::string> flags = {}) {
    device = std::make_unique<FakeDevice>(FakeDeviceOptions{serial, has_watchdog, true, true});
    std::ofstream(folder / "rig.yaml") << device->rig_text(0.003);
    std::ofstream(folder / "gains.yaml")
        << replaced(text_of(UPRIGHT_SOURCE_DIR "/config/gains/exponential.yaml"), "sample_rate_hz: 1000",
                    "sample_rate_hz: 200");
    std::vector<std::string> command = {"sh",
                                        "-c",
                                        "exec \"$@\" 2>'" + (folder / "err").string() + "'",
                                        "sh",
                                        UPRIGHT_BINARY,
                                        "run",
                                        "--unchecked",
                                        "--rig",
                                        folder / "rig.yaml",
                                        "--gains",
                                        folder / "gains.yaml",
                                        "--duration",
                                        "30",
                                        "--out",
                                        folder / "runs"};
    command.insert(command.end(), flags.begin(), flags.end());
    run = std::make_unique<Process>(command);
    ASSERT_TRUE(wait_for_rows(folder / "runs")) << text_of(folder / "err");
    std::this_thread::sleep_for(100ms);
    ASSERT_NE(device->voltage_v(), 0.0);
  }
  void signal(int number) { kill(run->id(), number); }
  int ended() {
    out = run->rest();
    const int code = run->wait();
    err = text_of(folder / "err");
    return code;
  }
  RunRecord record() { return read_run(only_entry(folder / "runs")); }
  std::string yaml() { return text_of(only_entry(folder / "runs") / "run.yaml"); }

  Folder folder;
  std::unique_ptr<FakeDevice> device;
  std::unique_ptr<Process> run;
  std::string out, err;
};

bool says(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

TEST_F(StopRun, IsConfirmedOnceABusyDeviceHasTakenZeroVolts) {
  start(false, false);
  device->begin(Trouble::busy, 0.8);
  signal(SIGINT);
  EXPECT_EQ(ended(), 3) << err;
  EXPECT_EQ(device->voltage_v(), 0.0);
  EXPECT_FALSE(device->enabled());
  EXPECT_TRUE(says(err, "not confirmed yet (the device answered with exception 06 (device busy))")) << err;
  EXPECT_TRUE(says(out, "Stopped at zero volts")) << out;
  EXPECT_TRUE(says(yaml(), "\n  zero_volts: confirmed\n"));
  const RunRecord read = record();
  const LogRecord& last = read.samples.rows.back();
  EXPECT_EQ(last.voltage_v, 0.0);
  EXPECT_NE(last.flags & row_flag::stopped, 0u);
  const ReplayResult replayed = replay(read);
  EXPECT_FALSE(replayed.first_mismatch.has_value());
  EXPECT_FALSE(replayed.first_lost_tick.has_value());
}

TEST_F(StopRun, SaysLoudlyThatZeroVoltsIsNotConfirmed) {
  start(false, false);
  device->begin(Trouble::ignores_writes, for_good_s);
  signal(SIGINT);
  std::this_thread::sleep_for(1500ms);
  const double again_s = monotonic_s();
  signal(SIGINT);
  EXPECT_EQ(ended(), 4);
  EXPECT_LT(monotonic_s() - again_s, 3.0) << "the second Ctrl-C ends the trying";
  EXPECT_NE(device->voltage_v(), 0.0);
  const std::string loud = "ZERO VOLTS COULD NOT BE CONFIRMED: switch the amplifier off";
  EXPECT_TRUE(says(err, loud)) << err;
  EXPECT_FALSE(says(out, "Stopped at zero volts")) << out;
  EXPECT_TRUE(says(yaml(), "\n  zero_volts: not_confirmed\n"));
  Process report({UPRIGHT_BINARY, "report", only_entry(folder / "runs")});
  report.rest();
  EXPECT_EQ(report.wait(), 0);
  const std::string page = text_of(only_entry(folder / "runs") / "report.html");
  EXPECT_TRUE(says(page, loud));
  EXPECT_FALSE(says(page, "Stopped at zero volts"));
}

TEST_F(StopRun, SaysSoInJsonTooAndNamesTheDevicesWatchdog) {
  start(true, true, {"--json"});
  device->begin(Trouble::silent, for_good_s);
  std::this_thread::sleep_for(500ms);  // the run has ended by itself and tries for zero volts
  EXPECT_EQ(device->voltage_v(), 0.0) << "the device's own watchdog";
  signal(SIGINT);
  EXPECT_EQ(ended(), 4) << err;
  EXPECT_TRUE(says(out, "\"zero_volts\": \"not_confirmed\"")) << out;
  EXPECT_TRUE(says(err, "takes the voltage away 0.1 s after")) << err;
}

TEST_F(StopRun, GoesOnAfterABusyDeviceWithinTheWatchdogsTimeAndNamesItBeyond) {
  start(false, false);
  device->begin(Trouble::busy, 0.5 * watchdog_s);
  std::this_thread::sleep_for(500ms);
  EXPECT_NE(device->voltage_v(), 0.0) << "it goes on";
  device->begin(Trouble::gateway_silent, 5 * watchdog_s);
  EXPECT_EQ(ended(), 3);
  EXPECT_TRUE(says(yaml(), "reason: link_lost")) << yaml();
  EXPECT_TRUE(says(yaml(), "exception 0B (no answer from the device behind the gateway)")) << yaml();
  EXPECT_EQ(device->voltage_v(), 0.0);
}

TEST_F(StopRun, EndsBySignalsThatWouldKillOrSuspendItAndIgnoresThoseOfTheBackground) {
  for (const int number : {SIGQUIT, SIGTSTP, SIGHUP}) {
    SCOPED_TRACE(number);
    std::filesystem::remove_all(folder / "runs");
    start(false, false);
    for (const int ignored : {SIGTTIN, SIGTTOU}) signal(ignored);
    std::this_thread::sleep_for(100ms);
    ASSERT_NE(device->voltage_v(), 0.0) << "it goes on";
    const double signalled_s = monotonic_s();
    signal(number);
    EXPECT_EQ(ended(), 3) << err;
    EXPECT_EQ(device->voltage_v(), 0.0);
    EXPECT_LT(device->voltage_since_s() - signalled_s, 0.2);
    EXPECT_EQ(record().samples.rows.back().voltage_v, 0.0);
  }
}

TEST_F(StopRun, NeverSendsAnOldVoltageAfterAStall) {
  for (const bool serial : {false, true}) {
    std::filesystem::remove_all(folder / "runs");
    start(serial, false);
    signal(SIGSTOP);
    std::this_thread::sleep_for(250ms);
    const double resumed_s = monotonic_s();
    signal(SIGCONT);
    EXPECT_EQ(ended(), 3) << err;
    for (const FakeDevice::Held& held : device->record())
      EXPECT_FALSE(held.time_s > resumed_s && held.voltage_v != 0.0);
  }
}

}  // namespace
}  // namespace upright::test
