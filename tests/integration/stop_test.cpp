// A stop against devices that are busy, refuse, reset, ignore or answer wrongly, for a while or for good,
// over TCP and RTU, with and without a watchdog of their own. Judged by the device's own record: zero volts
// is never called confirmed when it is not on the output, and it always gets there once the device lets it.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "fresh_reading.hpp"
#include "record/stop_report.hpp"
#include "stopped_device.hpp"
#include "tests/support/real_time.hpp"
#include "upright/base/error.hpp"

namespace upright::test {
namespace {

using namespace std::chrono_literals;

std::vector<StopCase> passing_troubles() {
  std::vector<StopCase> cases;
  for (const bool serial : {false, true})
    for (const bool has_watchdog : {false, true})
      for (const Trouble trouble :
           {Trouble::busy, Trouble::gateway_silent, Trouble::refuses_writes, Trouble::refuses_connections,
            Trouble::resets, Trouble::silent, Trouble::ignores_writes, Trouble::wrong_unit,
            Trouble::wrong_protocol, Trouble::wrong_length, Trouble::wrong_echo})
        for (const double for_s : {0.05, 0.5, 5.0}) cases.push_back({serial, has_watchdog, trouble, for_s});
  return cases;
}

/// All at once: they wait most of the time.
std::vector<Stopped> all_stopped(const std::vector<StopCase>& cases, const StopWatcher& watcher = {}) {
  std::vector<Stopped> results(cases.size());
  std::vector<std::thread> threads;
  threads.reserve(cases.size());
  for (std::size_t i = 0; i < cases.size(); ++i)
    threads.emplace_back([&, i] { results[i] = stopped(cases[i], watcher); });
  for (std::thread& thread : threads) thread.join();
  return results;
}

TEST(Stop, ReachesZeroVoltsOnceTheDeviceAcceptsAndConfirmsIt) {
  const std::vector<StopCase> cases = passing_troubles();
  const std::vector<Stopped> results = all_stopped(cases);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    SCOPED_TRACE(cases[i].name());
    const Stopped& result = results[i];
    EXPECT_DOUBLE_EQ(result.ran_v, run_v);
    EXPECT_TRUE(result.report.done()) << reason_of(result.report);
    EXPECT_TRUE(result.report.read_back);
    EXPECT_EQ(result.at_report_v, 0.0);
    EXPECT_EQ(result.later_v, 0.0);
    EXPECT_FALSE(result.enabled_later);
    EXPECT_LT(result.took_s, cases[i].for_s + 4.0);
    EXPECT_LT(result.on_for_s, cases[i].for_s + 4.0);
  }
}

TEST(Stop, IsNeverConfirmedByADeviceThatKeepsItsVoltage) {
  std::vector<StopCase> cases;
  constexpr double for_good_s = 60.0;
  for (const bool serial : {false, true})
    for (const Trouble trouble : {Trouble::busy, Trouble::refuses_writes, Trouble::refuses_connections,
                                  Trouble::resets, Trouble::silent, Trouble::ignores_writes})
      cases.push_back({serial, false, trouble, for_good_s});
  // Somebody presses Ctrl-C once more after a second.
  const double begun_s = monotonic_s();
  StopWatcher watcher;
  watcher.end_requests = [begun_s] { return monotonic_s() - begun_s > 2.0 ? 1u : 0u; };
  const std::vector<Stopped> results = all_stopped(cases, watcher);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    SCOPED_TRACE(cases[i].name());
    const Stopped& result = results[i];
    EXPECT_FALSE(result.report.zero_confirmed);
    EXPECT_DOUBLE_EQ(result.at_report_v, run_v);
    EXPECT_NE(sentence_of(result.report).find("ZERO VOLTS COULD NOT BE CONFIRMED: switch the amplifier off"),
              std::string::npos);
    EXPECT_NE(sentence_of(result.report).find("no watchdog"), std::string::npos);
    EXPECT_LT(result.took_s, 4.0);
  }
}

TEST(Stop, TriesForTenSecondsAndNamesTheDevicesOwnWatchdog) {
  in_real_time([] {
    const StopCase silent{false, true, Trouble::silent, 60.0};
    const Stopped result = stopped(silent);
    EXPECT_FALSE(result.report.zero_confirmed) << "nobody has said so";
    EXPECT_EQ(result.later_v, 0.0) << "though the watchdog did it";
    EXPECT_TIMING((Interval{result.begun_s, result.begun_s + result.on_for_s}), result.on_for_s < 0.2,
                  "zero volts in time");
    EXPECT_GT(result.took_s, 0.9 * stop_patience_s);
    EXPECT_LT(result.took_s, stop_patience_s + 1.0);
    EXPECT_NE(sentence_of(result.report).find("switches the voltage off 0.1 s after"), std::string::npos)
        << sentence_of(result.report);
  });
}

TEST(Stop, UsesAnotherFunctionWhere0x17IsRefusedAndDisables) {
  for (const bool serial : {false, true}) {
    const Stopped result = stopped({serial, false, Trouble::refuses_read_write, 60.0});
    EXPECT_TRUE(result.report.done());
    EXPECT_EQ(result.later_v, 0.0);
    EXPECT_FALSE(result.enabled_later);
    EXPECT_LT(result.took_s, 1.0);
  }
}

TEST(Stop, BelievesAnAcknowledgementWhereTheOutputCannotBeRead) {
  for (const bool serial : {false, true}) {
    const Stopped result = stopped({serial, false, Trouble::none, 0.0, false});
    EXPECT_TRUE(result.report.done());
    EXPECT_FALSE(result.report.read_back);
    EXPECT_EQ(result.later_v, 0.0);
  }
}

TEST(Stop, DoesNotHoldUpTheLoop) {
  in_real_time([] {
    Driven driven({false, false, Trouble::silent, 60.0});
    driven.device.begin(Trouble::silent, 60.0);
    for (int i = 0; i < 50; ++i) {
      const Since begin;
      driven.rig->stop();
      const Interval took = begin.until_now();
      EXPECT_TIMING(took, took.end_s - took.begin_s < 0.02, "no time-out is waited for");
      std::this_thread::sleep_for(2ms);
    }
  });
}

TEST(Open, RefusesADeviceThatAcknowledgesZeroVoltsAndKeepsAnother) {
  for (const bool serial : {false, true}) {
    Driven driven({serial, false, Trouble::none, 0.0});
    driven.device.begin(Trouble::ignores_writes, 60.0);
    // On a busy machine the rig may have written zero volts in between: then there is no voltage to keep.
    for (int i = 0; i < 20 && driven.device.voltage_v() != run_v; ++i) {
      driven.device.end_trouble();
      driven.drive();
      driven.device.begin(Trouble::ignores_writes, 60.0);
    }
    ASSERT_EQ(driven.device.voltage_v(), run_v);
    try {
      driven.rig->open();
      ADD_FAILURE() << "it opened";
    } catch (const DeviceError& error) {
      EXPECT_NE(std::string(error.what()).find("reads back"), std::string::npos) << error.what();
    }
    driven.device.end_trouble();
  }
}

TEST(Open, NamesTheExceptionThatTheDeviceAnswersWith) {
  const auto said = [](Driven& driven) -> std::string {
    try {
      driven.rig->open();
    } catch (const DeviceError& error) {
      return error.what();
    }
    return "";
  };
  Driven driven({false, false, Trouble::none, 0.0});
  driven.device.begin(Trouble::refuses_read_write, 60.0);
  EXPECT_NE(said(driven).find("refused with exception 01 (illegal function)"), std::string::npos);
  driven.device.begin(Trouble::busy, 60.0);
  EXPECT_NE(said(driven).find("exception 06 (device busy)"), std::string::npos);
}

TEST(Reading, IsNeverFreshByAReplyThatDoesNotFitItsRequest) {
  for (const bool serial : {false, true})
    for (const Trouble trouble :
         {Trouble::wrong_unit, Trouble::wrong_protocol, Trouble::wrong_length, Trouble::wrong_echo}) {
      const StopCase c{serial, false, trouble, 0.0};
      SCOPED_TRACE(c.name());
      Driven driven(c);
      driven.device.begin(trouble, 60.0);
      for (int i = 0; i < 5; ++i) EXPECT_NE(driven.rig->read().status, RigStatus::fresh);
      driven.device.end_trouble();
      EXPECT_EQ(fresh_reading(*driven.rig).fault, RigFault::none);
    }
}

void read_busy_device(bool serial, Trouble trouble, int number) {
  Driven driven({serial, false, trouble, 0.0});
  driven.device.begin(trouble, 60.0);
  for (int i = 0; i < 10; ++i) {
    const Since begin;
    const RigReading reading = driven.rig->read();
    const bool says_busy = reading.status == RigStatus::fault && reading.fault == RigFault::device_busy;
    EXPECT_TIMING(begin.until_now(), says_busy, "the device answers in time");
    EXPECT_EQ(driven.rig->last_exception(), number);
  }
  driven.device.end_trouble();
  EXPECT_EQ(fresh_reading(*driven.rig).fault, RigFault::none) << "the first after that";
}

TEST(Reading, CallsABusyDeviceBusyHoweverOftenItSaysSo) {
  for (const bool serial : {false, true})
    for (const auto& [trouble, number] : {std::pair{Trouble::busy, 6}, {Trouble::gateway_silent, 11}})
      if (!IsSkipped()) in_real_time([&, t = trouble, n = number] { read_busy_device(serial, t, n); });
}

void write_after_stall(bool serial) {
  Driven driven({serial, false, Trouble::none, 0.0});
  EXPECT_DOUBLE_EQ(driven.device.voltage_v(), run_v);
  std::this_thread::sleep_for(250ms);
  const Since resumed;
  EXPECT_EQ(fresh_reading(*driven.rig).fault, RigFault::none);
  driven.rig->write(1.0);
  std::this_thread::sleep_for(50ms);
  for (const FakeDevice::Held& held : driven.device.record())
    EXPECT_FALSE(held.time_s > resumed.begin_s() && held.voltage_v == run_v) << "sent again";
  EXPECT_TIMING(resumed.until_now(), driven.device.voltage_v() == 1.0, "the new voltage arrives in time");
}

TEST(Reading, SendsNoOldVoltageAfterAStall) {
  for (const bool serial : {false, true})
    if (!IsSkipped()) in_real_time([=] { write_after_stall(serial); });
}

TEST(Reading, SendsNoOldVoltageWhenTheLinkComesBack) {
  for (const bool serial : {false, true}) {
    Driven driven({serial, false, Trouble::none, 0.0});
    driven.device.begin(Trouble::refuses_connections, 0.3);
    const double begun_s = monotonic_s();
    while (monotonic_s() - begun_s < 0.6) {
      driven.rig->read();
      std::this_thread::sleep_for(5ms);
    }
    for (const FakeDevice::Held& held : driven.device.record())
      EXPECT_FALSE(held.time_s > begun_s + 0.25 && held.voltage_v == run_v);
  }
}

}  // namespace
}  // namespace upright::test
