// The Modbus client against the virtual rig as a second process, over TCP and over a pseudo-terminal paced to
// its baud rate: same counts, no old count passed off as new under any fault, one cause per fault, zero volts
// seen from the plant's side.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <thread>

#include "fresh_reading.hpp"
#include "tests/support/real_time.hpp"
#include "upright/base/error.hpp"
#include "upright/hal/rig_factory.hpp"
#include "virtual_rig_process.hpp"

namespace upright::test {
namespace {

using namespace std::chrono_literals;
const std::string rigs = UPRIGHT_SOURCE_DIR "/config/rigs/";
constexpr double watchdog_s = 0.1;

/// A link and a register map to test.
struct Map {
  const char* name;
  bool serial;
  std::vector<std::pair<std::string, std::string>> changes;  // in the shipped rig file
};

std::string rig_text_of(const Map& map) {
  std::string text = text_of(rigs + (map.serial ? "modbus-rtu.yaml" : "modbus-tcp.yaml"));
  for (const auto& [from, to] : map.changes) text = replaced(text, from, to);
  // The machine may be busy: what is tested here is what is done, not how fast.
  return replaced(text, map.serial ? "response_timeout_s: 0.002" : "response_timeout_s: 0.0008",
                  "response_timeout_s: 0.01");
}

std::unique_ptr<Rig> connect(const Folder& folder, const std::string& text, const VirtualRigProcess& server,
                             bool serial, double period_s = 0.02) {
  const std::string pointed = serial ? replaced(text, "/dev/ttyUSB0", server.name())
                                     : replaced(text, "port: 1502", "port: " + std::to_string(server.port()));
  const std::filesystem::path file = folder / "client.yaml";
  std::ofstream(file) << pointed;
  return make_rig(read_rig_file(file), {period_s});
}

class ModbusMap : public testing::TestWithParam<Map> {
 protected:
  std::string text = rig_text_of(GetParam());
  bool serial = GetParam().serial;
  Folder folder;
};

TEST_P(ModbusMap, CountsComeBackAndVoltagesArrive) {
  in_real_time([this] {
    VirtualRigProcess server(folder, text, serial, {"--theta0-deg", "-2.5"});
    auto rig = connect(folder, text, server, serial);
    rig->open();
    const RigReading at_rest = fresh_reading(*rig);
    EXPECT_EQ(at_rest.cart_counts, 0);
    EXPECT_EQ(at_rest.pendulum_counts, -28);  // -2.5 degrees of 4096 counts a turn, to the nearest
    const std::uint64_t first = at_rest.sequence;
    EXPECT_GT(fresh_reading(*rig).sequence, first);
    const Since driven;
    rig->write(1.5);
    std::this_thread::sleep_for(60ms);
    for (int i = 0; i < 5; ++i) {
      rig->read();
      rig->write(-3.25);
      std::this_thread::sleep_for(10ms);
    }
    const Interval driving = driven.until_now();
    rig.reset();
    EXPECT_EQ(server.end(), 0);
    bool saw_first = false, saw_second = false;
    for (const TraceRow& row : server.trace()) {
      saw_first = saw_first || std::abs(row.voltage_v - 1.5) < 1e-3;
      saw_second = saw_second || std::abs(row.voltage_v + 3.25) < 1e-3;
    }
    EXPECT_TIMING(driving, saw_first && saw_second, "voltages arrive before they are old");
    EXPECT_EQ(server.trace().back().voltage_v, 0.0);
  });
}

TEST_P(ModbusMap, SilenceEndsInZeroVoltsByTheDevicesWatchdog) {
  in_real_time([this] {
    VirtualRigProcess server(folder, text, serial);
    auto rig = connect(folder, text, server, serial);
    rig->open();
    rig->write(2.0);
    std::this_thread::sleep_for(400ms);
    server.end();
    double on_s = 0, off_s = 0;
    for (const TraceRow& row : server.trace()) {
      if (row.voltage_v != 0.0 && on_s == 0.0) on_s = row.time_s;
      if (row.voltage_v == 0.0 && on_s != 0.0 && off_s == 0.0) off_s = row.time_s;
    }
    ASSERT_GT(on_s, 0.0);
    // With the amplifier's enable register the last valid request is one exchange later than the voltage.
    EXPECT_GE(off_s - on_s, watchdog_s - 1e-6);
    EXPECT_TIMING((Interval{on_s, off_s}), off_s - on_s < watchdog_s + 0.05, "the watchdog is in time");
  });
}

INSTANTIATE_TEST_SUITE_P(
    Maps, ModbusMap,
    testing::Values(Map{"tcp", false, {}}, Map{"rtu", true, {}},
                    Map{"tcp_separate", false, {{"exchange: read_write", "exchange: separate"}}},
                    Map{"tcp_input_registers",
                        false,
                        {{"exchange: read_write", "exchange: separate"}, {"table: holding", "table: input"}}},
                    Map{"rtu_low_word_first",
                        true,
                        {{"exchange: read_write", "exchange: separate"}, {"high_first", "low_first"}}},
                    Map{"tcp_16_bit_counters",
                        false,
                        {{"width_bits: 32", "width_bits: 16"},
                         {"width_bits: 32", "width_bits: 16"},
                         {"registers: 2", "registers: 1"}}},
                    Map{"tcp_float_voltage",
                        false,
                        {{"address: 16, encoding: int16",
                          "address: 20, word_order: low_first, encoding: float32"}}},
                    Map{"tcp_without_extras",
                        false,
                        {{"  boot_count_address: 4\n", ""},
                         {"  enable_address: 17\n", ""},
                         {"  device_watchdog: {address: 18, time_s: 0.1, seconds_per_count: 0.001}\n", ""}}}),
    [](const auto& item) { return std::string(item.param.name); });

struct Faults {
  const char* name;
  bool serial;
  std::vector<std::string> flags;
};

class ModbusFaults : public testing::TestWithParam<Faults> {};

struct Taken {
  double from_s, to_s;
  std::int64_t cart;
};

/// Swings the cart to and fro for three seconds; the fresh readings. The others are counted.
std::vector<Taken> swing(Rig& rig, int& not_fresh) {
  std::vector<Taken> taken;
  std::uint64_t sequence = 0;
  const double start_s = monotonic_s();
  for (int k = 0; k < 500; ++k) {
    const double from_s = monotonic_s();
    const RigReading reading = rig.read();
    const double to_s = monotonic_s();
    if (reading.status == RigStatus::fresh) {
      EXPECT_EQ(reading.fault, RigFault::none);
      EXPECT_GT(reading.sequence, sequence);
      sequence = reading.sequence;
      taken.push_back({from_s, to_s, reading.cart_counts});
    } else {
      EXPECT_TRUE(reading.fault == RigFault::link_timeout || reading.fault == RigFault::link_lost ||
                  reading.fault == RigFault::corrupt_reply || reading.fault == RigFault::device_refused);
      ++not_fresh;
    }
    rig.write(3.0 * std::cos(2.0 * std::numbers::pi * 1.5 * 0.005 * k));
    std::this_thread::sleep_for(std::chrono::duration<double>(start_s + 0.005 * (k + 1) - monotonic_s()));
  }
  return taken;
}

/// Holds every fresh reading against what the plant did while that exchange was under way.
TEST_P(ModbusFaults, NoOldCountIsEverFresh) {
  in_real_time([] {
    const bool serial = GetParam().serial;
    const std::string text =
        replaced(rig_text_of({"", serial, {}}), "response_timeout_s: 0.01", "response_timeout_s: 0.003");
    const Folder folder;
    VirtualRigProcess server(folder, text, serial, GetParam().flags);
    auto rig = connect(folder, text, server, serial, 0.005);
    rig->open();
    int not_fresh = 0;
    const Since begin;
    const std::vector<Taken> taken = swing(*rig, not_fresh);
    const Interval swinging = begin.until_now();
    rig.reset();
    server.end();
    const bool faulty = !GetParam().flags.empty();
    EXPECT_GE(not_fresh, faulty ? 5 : 0);
    const std::vector<TraceRow> trace = server.trace();
    std::size_t wrong = 0;
    for (const Taken& t : taken) {
      constexpr double line_s = 0.001;  // apart, in the trace
      const CartRange range = cart_between(trace, t.from_s - line_s, t.to_s + line_s);
      if (!range.holds(2.27485e-5 * static_cast<double>(t.cart))) ++wrong;
    }
    // A wrong bit in a TCP reply has no check sum to betray it; what no motion explains is refused.
    const bool undetectable = !serial && faulty && GetParam().flags.front() == "--inject-corrupt-every";
    EXPECT_LE(wrong, undetectable ? taken.size() : 0u);
    EXPECT_TIMING(swinging, taken.size() > 200u, "most replies come in time");
  });
}

INSTANTIATE_TEST_SUITE_P(
    Faults, ModbusFaults,
    testing::Values(Faults{"tcp_none", false, {}}, Faults{"rtu_none", true, {}},
                    Faults{"tcp_late", false, {"--inject-late-every", "20", "--inject-late-ms", "7"}},
                    Faults{"rtu_late", true, {"--inject-late-every", "20", "--inject-late-ms", "7"}},
                    Faults{"tcp_drop", false, {"--inject-drop-every", "20"}},
                    Faults{"rtu_drop", true, {"--inject-drop-every", "20"}},
                    Faults{"tcp_corrupt", false, {"--inject-corrupt-every", "20"}},
                    Faults{"rtu_corrupt", true, {"--inject-corrupt-every", "20"}}),
    [](const auto& item) { return std::string(item.param.name); });

class ModbusRestart : public testing::TestWithParam<bool> {};

TEST_P(ModbusRestart, IsNamed) {
  const bool serial = GetParam();
  const std::string text = rig_text_of({"", serial, {}});
  Folder folder;
  VirtualRigProcess server(folder, text, serial, {"--inject-restart-after", "0.3"});
  auto rig = connect(folder, text, server, serial);
  rig->open();
  RigFault last = RigFault::none;
  for (int k = 0; k < 100 && last != RigFault::device_restarted; ++k) {
    last = rig->read().fault;
    rig->write(0.5);
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(last, RigFault::device_restarted);
  EXPECT_EQ(rig->read().fault, RigFault::device_restarted) << "latched";
  rig->open();
  EXPECT_EQ(fresh_reading(*rig).fault, RigFault::none) << "opening again is deliberate";
}

INSTANTIATE_TEST_SUITE_P(Links, ModbusRestart, testing::Bool(),
                         [](const auto& item) { return std::string(item.param ? "rtu" : "tcp"); });

TEST(ModbusRig, ServerKilledAndStartedAgainIsARestart) {
  const std::string text = rig_text_of({"", false, {}});
  Folder folder;
  auto server = std::make_unique<VirtualRigProcess>(folder, text, false);
  auto rig = connect(folder, text, *server, false);
  rig->open();
  fresh_reading(*rig);
  const std::string address = server->name();
  server->end(SIGKILL);
  EXPECT_EQ(rig->read().status, RigStatus::fault);
  std::this_thread::sleep_for(10ms);
  EXPECT_EQ(rig->read().fault, RigFault::link_lost);
  server = std::make_unique<VirtualRigProcess>(folder, text, false, std::vector<std::string>{}, address);
  RigFault last = RigFault::none;
  for (int k = 0; k < 100 && last != RigFault::device_restarted; ++k) {
    last = rig->read().fault;
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(last, RigFault::device_restarted);
}

TEST(ModbusRig, RefusesWhatIsNotFiniteAndStopsForGood) {
  in_real_time([] {
    const std::string text = rig_text_of({"", false, {}});
    Folder folder;
    VirtualRigProcess server(folder, text, false);
    auto rig = connect(folder, text, server, false);
    rig->open();
    const Since driven;
    rig->write(1.0);
    std::this_thread::sleep_for(20ms);
    const Interval driving = driven.until_now();
    EXPECT_EQ(rig->write(std::nan("")), RigFault::not_finite);
    std::this_thread::sleep_for(20ms);
    rig->stop();
    rig->write(5.0);
    std::this_thread::sleep_for(50ms);
    server.end();
    double highest_v = 0.0;
    for (const TraceRow& row : server.trace()) highest_v = std::max(highest_v, std::abs(row.voltage_v));
    EXPECT_LE(highest_v, 1.0);
    EXPECT_TIMING(driving, highest_v > 0.0, "the first voltage arrives before it is old");
    EXPECT_EQ(server.trace().back().voltage_v, 0.0);
  });
}

TEST(ModbusRig, NothingThereIsADeviceError) {
  Folder folder;
  const std::filesystem::path file = folder / "rig.yaml";
  std::ofstream(file) << replaced(rig_text_of({"", false, {}}), "port: 1502", "port: 1");
  auto rig = make_rig(read_rig_file(file), {0.02});
  EXPECT_THROW(rig->open(), DeviceError);
}

TEST(ModbusRig, TimeoutMustFitIntoThePeriod) {
  const RigFile rig = read_rig_file(rigs + "modbus-tcp.yaml");
  EXPECT_THROW(make_rig(rig, {0.0008}), ConfigError);
  EXPECT_NO_THROW(make_rig(rig, {0.002}));
}

}  // namespace
}  // namespace upright::test
