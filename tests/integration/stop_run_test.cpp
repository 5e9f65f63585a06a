// `upright run` and its end, against a device of the tests' own: what it says of zero volts, on the terminal,
// in run.yaml, in JSON and in the report, and with which exit code; which signals end it; what a busy device
// and a stall come to. Judged by the device's record.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <thread>

#include "fake_device.hpp"
#include "tests/support/run_end.hpp"
#include "upright/record/replay.hpp"
#include "upright/record/run_reader.hpp"
#include "virtual_rig_process.hpp"

namespace upright::test {
namespace {

using namespace std::chrono_literals;

constexpr double for_good_s = 60.0, watchdog_s = 0.1;

/// A run that has begun to drive a device.
class StopRun {
 public:
  explicit StopRun(bool serial = false, bool has_watchdog = false,
                   const std::vector<std::string>& flags = {}) {
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
    process = std::make_unique<Process>(command);
    EXPECT_TRUE(wait_for_rows(folder / "runs")) << text_of(folder / "err");
    std::this_thread::sleep_for(100ms);
    expect_it_goes_on();
  }
  void expect_it_goes_on() {
    if (const auto end = run_end(yaml())) EXPECT_END(*end, false);
    EXPECT_NE(device->voltage_v(), 0.0);
  }
  void signal(int number) { kill(process->id(), number); }
  /// The exit code of a run that ends for one of these reasons.
  int ended_by(const std::vector<std::string>& reasons) {
    out = process->rest();
    const int code = process->wait();
    err = text_of(folder / "err");
    const std::optional<RunEnd> end = run_end(yaml());
    EXPECT_TRUE(end.has_value()) << err;
    if (end) EXPECT_END(*end, std::count(reasons.begin(), reasons.end(), end->reason) > 0);
    return code;
  }
  RunRecord record() { return read_run(only_entry(folder / "runs")); }
  std::string yaml() { return text_of(only_entry(folder / "runs") / "run.yaml"); }

  Folder folder;
  std::unique_ptr<FakeDevice> device;
  std::unique_ptr<Process> process;
  std::string out, err;
};

bool says(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

TEST(StopRun, IsConfirmedOnceABusyDeviceHasTakenZeroVolts) {
  in_real_time([] {
    StopRun run;
    run.device->begin(Trouble::busy, 0.8);
    run.signal(SIGINT);
    EXPECT_EQ(run.ended_by({"signal"}), 3) << run.err;
    EXPECT_EQ(run.device->voltage_v(), 0.0);
    EXPECT_FALSE(run.device->enabled());
    EXPECT_TRUE(says(run.err, "not confirmed yet (the device answered with exception 06 (device busy))"))
        << run.err;
    EXPECT_TRUE(says(run.out, "Stopped at zero volts")) << run.out;
    EXPECT_TRUE(says(run.yaml(), "\n  zero_volts: confirmed\n"));
    const RunRecord read = run.record();
    const LogRecord& last = read.samples.rows.back();
    EXPECT_EQ(last.voltage_v, 0.0);
    EXPECT_NE(last.flags & row_flag::stopped, 0u);
    const ReplayResult replayed = replay(read);
    EXPECT_FALSE(replayed.first_mismatch.has_value());
    EXPECT_FALSE(replayed.first_lost_tick.has_value());
  });
}

TEST(StopRun, SaysLoudlyThatZeroVoltsIsNotConfirmed) {
  in_real_time([] {
    StopRun run;
    run.device->begin(Trouble::ignores_writes, for_good_s);
    run.signal(SIGINT);
    std::this_thread::sleep_for(1500ms);
    const double again_s = monotonic_s();
    run.signal(SIGINT);
    EXPECT_EQ(run.ended_by({"signal"}), 4);
    EXPECT_LT(monotonic_s() - again_s, 3.0) << "the second Ctrl-C ends the trying";
    EXPECT_NE(run.device->voltage_v(), 0.0);
    const std::string loud = "ZERO VOLTS COULD NOT BE CONFIRMED: switch the amplifier off";
    EXPECT_TRUE(says(run.err, loud)) << run.err;
    EXPECT_FALSE(says(run.out, "Stopped at zero volts")) << run.out;
    EXPECT_TRUE(says(run.yaml(), "\n  zero_volts: not_confirmed\n"));
    Process report({UPRIGHT_BINARY, "report", only_entry(run.folder / "runs")});
    report.rest();
    EXPECT_EQ(report.wait(), 0);
    const std::string page = text_of(only_entry(run.folder / "runs") / "report.html");
    EXPECT_TRUE(says(page, loud));
    EXPECT_FALSE(says(page, "Stopped at zero volts"));
  });
}

TEST(StopRun, SaysSoInJsonTooAndNamesTheDevicesWatchdog) {
  in_real_time([] {
    StopRun run(true, true, {"--json"});
    run.device->begin(Trouble::silent, for_good_s);
    std::this_thread::sleep_for(500ms);  // the run has ended by itself and tries for zero volts
    EXPECT_EQ(run.device->voltage_v(), 0.0) << "the device's own watchdog";
    run.signal(SIGINT);
    EXPECT_EQ(run.ended_by({"link_lost", "stale_encoder"}), 4) << run.err;
    EXPECT_TRUE(says(run.out, "\"zero_volts\": \"not_confirmed\"")) << run.out;
    EXPECT_TRUE(says(run.err, "switches the voltage off 0.1 s after")) << run.err;
  });
}

TEST(StopRun, GoesOnAfterABusyDeviceWithinTheWatchdogsTime) {
  in_real_time([] {
    StopRun run;
    run.device->begin(Trouble::busy, 0.5 * watchdog_s);
    std::this_thread::sleep_for(500ms);
    run.expect_it_goes_on();
    run.device->begin(Trouble::gateway_silent, 5 * watchdog_s);
    EXPECT_EQ(run.ended_by({"link_lost"}), 3);
    EXPECT_TRUE(says(run.yaml(), "exception 0B (no answer from the device behind the gateway)"))
        << run.yaml();
    EXPECT_EQ(run.device->voltage_v(), 0.0);
  });
}

void end_by(int number) {
  StopRun run;
  for (const int ignored : {SIGTTIN, SIGTTOU}) run.signal(ignored);
  std::this_thread::sleep_for(100ms);
  run.expect_it_goes_on();
  const double signalled_s = monotonic_s();
  run.signal(number);
  EXPECT_EQ(run.ended_by({"signal"}), 3) << run.err;
  EXPECT_EQ(run.device->voltage_v(), 0.0);
  const double zero_s = run.device->voltage_since_s();
  EXPECT_TIMING((Interval{signalled_s, zero_s}), zero_s - signalled_s < 0.2, "zero volts in time");
  EXPECT_EQ(run.record().samples.rows.back().voltage_v, 0.0);
}

TEST(StopRun, EndsByKillAndSuspendSignalsIgnoresBackgroundOnes) {
  for (const int number : {SIGQUIT, SIGTSTP, SIGHUP}) {
    SCOPED_TRACE(number);
    if (!IsSkipped()) in_real_time([=] { end_by(number); });
  }
}

void stall(bool serial) {
  StopRun run(serial);
  run.signal(SIGSTOP);
  std::this_thread::sleep_for(250ms);
  const double resumed_s = monotonic_s();
  run.signal(SIGCONT);
  EXPECT_EQ(run.ended_by({"overrun"}), 3) << run.err;
  EXPECT_EQ(says(run.yaml(), "has no real-time scheduling"), !says(run.yaml(), "SCHED_FIFO")) << run.yaml();
  for (const FakeDevice::Held& held : run.device->record())
    EXPECT_FALSE(held.time_s > resumed_s && held.voltage_v != 0.0);
}

TEST(StopRun, NeverSendsAnOldVoltageAfterAStall) {
  for (const bool serial : {false, true})
    if (!IsSkipped()) in_real_time([=] { stall(serial); });
}

}  // namespace
}  // namespace upright::test
