// The fault suite's rows on stops that a Modbus device does not obey at once, or at all: what its own record
// says, and what is said of it.
#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <vector>

#include "../integration/stopped_device.hpp"
#include "evidence.hpp"

namespace upright::test {
namespace {

constexpr double trouble_s = 1.0, for_good_s = 60.0;
/// Between two attempts, with their time-outs, and what a busy machine adds.
constexpr double noticed_within_s = 1.5;

struct StopFault {
  const char* key;
  Trouble trouble;
  bool for_good = false;
  bool has_watchdog = false;
};

const std::vector<StopFault>& stop_faults() {
  static const std::vector<StopFault> list = {
      {"stop_busy", Trouble::busy},
      {"stop_refused_connections", Trouble::refuses_connections},
      {"stop_resets", Trouble::resets},
      {"stop_wrong_replies", Trouble::wrong_unit},
      {"stop_ignored", Trouble::ignores_writes},
      {"stop_refused_function", Trouble::refuses_read_write, true},
      {"stop_ignored_for_good", Trouble::ignores_writes, true},
      {"stop_silent_watchdog", Trouble::silent, true, true},
  };
  return list;
}

struct On {
  StopFault fault;
  bool serial;
};

void PrintTo(const On& on, std::ostream* out) {
  *out << on.fault.key << (on.serial ? " over RTU" : " over TCP");
}

std::vector<On> all() {
  std::vector<On> list;
  for (const StopFault& fault : stop_faults())
    for (const bool serial : {false, true}) list.push_back({fault, serial});
  return list;
}

/// As the table says it.
std::string cell_of(const StopFault& fault) {
  const std::string code = "reported as not confirmed, exit code 4";
  if (fault.trouble == Trouble::refuses_read_write) return "0 V at once by function 0x10, confirmed";
  if (!fault.for_good) return "0 V as soon as it responds, then confirmed";
  if (fault.has_watchdog) return "device watchdog: 0 V within 100 ms, " + code;
  return "the voltage remains, " + code;
}

/// What the device's record and the report come to.
void judge_stop(const StopFault& fault, const Stopped& result) {
  EXPECT_DOUBLE_EQ(result.ran_v, run_v);
  const bool obeys = !fault.for_good || fault.trouble == Trouble::refuses_read_write;
  EXPECT_EQ(result.report.done(), obeys);
  if (obeys) {
    EXPECT_EQ(result.at_report_v, 0.0);
    EXPECT_EQ(result.later_v, 0.0);
    EXPECT_FALSE(result.enabled_later);
    EXPECT_LT(result.on_for_s, (fault.for_good ? 0.0 : trouble_s) + noticed_within_s);
    return;
  }
  EXPECT_FALSE(result.report.zero_confirmed);
  EXPECT_EQ(result.later_v, fault.has_watchdog ? 0.0 : run_v);
  if (!fault.has_watchdog) return;
  EXPECT_TIMING((Interval{result.begun_s, result.begun_s + result.on_for_s}), result.on_for_s < 0.1 + 0.05,
                "the device's watchdog is in time");
}

class ModbusStop : public testing::TestWithParam<On> {};

TEST_P(ModbusStop, HasItsOutcome) {
  const StopFault& fault = GetParam().fault;
  const Bench bench = GetParam().serial ? Bench::modbus_rtu : Bench::modbus_tcp;
  fault_case(fault.key, bench, cell_of(fault), [&] {
    const double begun_s = monotonic_s();
    StopWatcher watcher;  // somebody presses Ctrl-C once more
    watcher.end_requests = [&] { return fault.for_good && monotonic_s() - begun_s > 2.0 ? 1u : 0u; };
    const StopCase c{GetParam().serial, fault.has_watchdog, fault.trouble,
                     fault.for_good ? for_good_s : trouble_s};
    judge_stop(fault, stopped(c, watcher));
  });
}

INSTANTIATE_TEST_SUITE_P(, ModbusStop, testing::ValuesIn(all()), [](const auto& item) {
  return std::string(item.param.fault.key) + (item.param.serial ? "_rtu" : "_tcp");
});

}  // namespace
}  // namespace upright::test
