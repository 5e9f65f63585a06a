// The fault suite over Modbus: `upright run` against `upright virtual-rig`, each a process of its own. The
// faults of link and encoders are the virtual rig's, those of the machine are done to the controller; the
// record is the virtual rig's own.
#include <gtest/gtest.h>

#include <fstream>
#include <memory>
#include <optional>
#include <utility>

#include "../integration/virtual_rig_process.hpp"
#include "broken_run.hpp"
#include "evidence.hpp"
#include "process_case.hpp"
#include "upright/record/run_reader.hpp"

namespace upright::test {
namespace {

const std::string config = UPRIGHT_SOURCE_DIR "/config/";
constexpr double period_s = 0.005;
constexpr double watchdog_s = 0.1;
constexpr double after_s = 0.5;  // faults begin so long after the controller took over
const std::string after = "0.5";

/// Texts to replace in a file, one after the other.
using Changes = std::vector<std::pair<std::string, std::string>>;

struct Case {
  ProcessCase process;
  std::vector<std::string> inject = {};  ///< flags of the virtual rig
  Changes rig = {};                      ///< in the rig file, of both sides
};

std::vector<Case> link_cases() {
  const auto one_in_20 = [&](const char* fault, const char* flag, std::vector<std::string> more = {}) {
    Case c{{.fault = fault, .expectation = goes_on()}, {flag, "20"}};
    c.inject.insert(c.inject.end(), more.begin(), more.end());
    return c;
  };
  const Expectation lost = stops({"link_lost", "stale_encoder"}, watchdog_s + period_s);
  // Where no reply comes in time, each cycle waits for the whole timeout. The rest of its period must be
  // longer than what the tests excuse as a stall of the machine.
  const Changes no_reply = {{"response_timeout_s: 0.003", "response_timeout_s: 0.001"}};
  return {
      one_in_20("late", "--inject-late-every", {"--inject-late-ms", "7"}),
      one_in_20("drop", "--inject-drop-every"),
      one_in_20("corrupt", "--inject-corrupt-every"),
      one_in_20("stale", "--inject-stale-every"),
      one_in_20("reorder", "--inject-reorder-every"),
      {{.fault = "silent", .expectation = lost, .begins = Begins::at_the_start},
       {"--inject-drop-every", "1"},
       no_reply},
      {{.fault = "always_late", .expectation = lost, .begins = Begins::at_the_start},
       {"--inject-late-every", "1", "--inject-late-ms", "300"},
       no_reply},
      {{.fault = "cut", .expectation = lost}, {"--inject-cut-after", after}},
      {{.fault = "restart", .expectation = stops({"rig_fault"}, period_s)},
       {"--inject-restart-after", after}},
  };
}

std::vector<Case> encoder_cases() {
  const Expectation stuck = stops({"stuck_encoder"}, stuck_noticed_s);
  return {
      {{.fault = "stuck_cart", .expectation = stuck, .duration_s = 4.0},
       {"--inject-stick", "cart", "--inject-stick-after", after}},
      {{.fault = "stuck_pendulum", .expectation = stuck, .duration_s = 4.0},
       {"--inject-stick", "pendulum", "--inject-stick-after", after}},
      {{.fault = "jump", .expectation = stops({"rig_fault"}, 4 * period_s)},
       {"--inject-jump-after", after, "--inject-jump-counts", "5000"}},
      {{.fault = "wrap", .expectation = goes_on()},
       {},
       {{"width_bits: 32", "width_bits: 16"},
        {"width_bits: 32", "width_bits: 16"},
        {"registers: 2", "registers: 1"},
        {"cart_counts: 0, pendulum_counts: 0", "cart_counts: 32760, pendulum_counts: -32768"}}},
  };
}

std::vector<Case> process_cases() {
  // The virtual rig's watchdog takes the voltage away while the controller stands still.
  const Expectation stood_still = stops({"overrun"}, watchdog_s + period_s);
  std::vector<Case> cases;
  for (const std::vector<ProcessCase>& list : {sign_cases(), machine_cases(period_s, stood_still)})
    for (const ProcessCase& c : list) cases.push_back({c});
  return cases;
}

struct On {
  Case what;
  bool serial;
};

void PrintTo(const On& on, std::ostream* out) {
  *out << on.what.process.fault << (on.serial ? " over RTU" : " over TCP");
}

std::vector<On> all() {
  std::vector<On> list;
  for (const std::vector<Case>& cases : {link_cases(), encoder_cases(), process_cases()})
    for (const Case& c : cases)
      for (const bool serial : {false, true}) list.push_back({c, serial});
  return list;
}

/// The rig and its controller's files, for either link.
class Setting : public RunFolder {
 public:
  Setting(bool serial, const Case& c) {
    // The machine may be busy: what is tested here is what is done, not how fast.
    rig_ = changed(
        text_of(config + "rigs/" + (serial ? "modbus-rtu.yaml" : "modbus-tcp.yaml")),
        {{serial ? "response_timeout_s: 0.002" : "response_timeout_s: 0.0008", "response_timeout_s: 0.003"}});
    rig_ = changed(rig_, c.rig);
    server_ = std::make_unique<VirtualRigProcess>(folder(), rig_, serial, c.inject);
    std::ofstream(rig_file()) << as_read(
        c.process, serial ? replaced(rig_, "/dev/ttyUSB0", server_->name())
                          : replaced(rig_, "port: 1502", "port: " + std::to_string(server_->port())));
    std::ofstream(gain_file()) << replaced(text_of(config + "gains/exponential.yaml"), "sample_rate_hz: 1000",
                                           "sample_rate_hz: 200");
  }
  VirtualRigProcess& server() { return *server_; }

 private:
  static std::string changed(std::string text, const Changes& changes) {
    for (const auto& [from, to] : changes) text = replaced(text, from, to);
    return text;
  }

  std::string rig_;
  std::unique_ptr<VirtualRigProcess> server_;
};

std::optional<Evidence> evidence_of(const Case& c, Setting& setting) {
  const ProcessFiles files = setting.files(c.process.duration_s);
  const std::optional<double> done_s = run_with(c.process, files);
  if (!done_s || !std::filesystem::exists(setting.runs())) return std::nullopt;
  sleep_s(watchdog_s);
  setting.server().end();
  const std::vector<TraceRow> trace = setting.server().trace();
  const double first_s = let_go_s(trace);
  Evidence evidence;
  evidence.run = only_entry(setting.runs());
  evidence.plant = plant_rows(trace);
  evidence.fault_s = begin_of(c.process, files, first_s, first_s + after_s, *done_s);
  evidence.log_may_end = c.process.begins == Begins::when_the_log_ends;
  return evidence;
}

class ModbusFault : public testing::TestWithParam<On> {};

Bench bench_of(bool serial) {
  return serial ? Bench::modbus_rtu : Bench::modbus_tcp;
}

TEST_P(ModbusFault, HasItsOutcome) {
  const On& on = GetParam();
  const Expectation& expectation = on.what.process.expectation;
  fault_case(on.what.process.fault, bench_of(on.serial), cell_of(expectation), [&] {
    Setting setting(on.serial, on.what);
    const auto evidence = came_about(setting.runs(), [&] { return evidence_of(on.what, setting); });
    if (evidence) judge(*evidence, expectation);
  });
}

INSTANTIATE_TEST_SUITE_P(, ModbusFault, testing::ValuesIn(all()), [](const auto& item) {
  return std::string(item.param.what.process.fault) + (item.param.serial ? "_rtu" : "_tcp");
});

struct Killed {
  double killed_s = 0.0, on_until_s = 0.0;
  std::size_t rows = 0;
};

std::optional<Killed> killed(Setting& setting) {
  const std::optional<double> killed_s = kill_run(setting.files(60.0));
  if (!killed_s) return std::nullopt;
  sleep_s(2 * watchdog_s);
  setting.server().end();
  return Killed{*killed_s, last_voltage_s(setting.server().trace()),
                read_run(only_entry(setting.runs())).samples.rows.size()};
}

class ModbusKilled : public testing::TestWithParam<bool> {};

TEST_P(ModbusKilled, IsAtZeroVoltsByTheDevicesWatchdog) {
  const bool serial = GetParam();
  fault_case("sigkill", bench_of(serial), "device watchdog: 0 V within 100 ms", [&] {
    Setting setting(serial, {});
    const auto run = came_about(setting.runs(), [&] { return killed(setting); });
    if (!run) return;
    EXPECT_TIMING((Interval{run->killed_s - watchdog_s, run->killed_s}),
                  run->on_until_s > run->killed_s - watchdog_s, "it was still balancing");
    EXPECT_TIMING((Interval{run->killed_s, run->on_until_s}),
                  run->on_until_s < run->killed_s + watchdog_s + 0.05, "the watchdog is in time");
    EXPECT_GT(run->rows, 0u) << "the log reads";
  });
}

INSTANTIATE_TEST_SUITE_P(, ModbusKilled, testing::Bool(), [](const auto& item) {
  return std::string(item.param ? "sigkill_rtu" : "sigkill_tcp");
});

std::optional<Evidence> evidence_of_a_broken_controller(Setting& setting) {
  const ProcessFiles files = setting.files(0.0);
  const std::optional<BrokenRun> run = broken_run(files.rig_file, setting.gain_file(), files.runs);
  if (!run) return std::nullopt;
  sleep_s(watchdog_s);
  setting.server().end();
  return Evidence{plant_rows(setting.server().trace()), run->began_s, run->directory, false, false};
}

class ModbusBroken : public testing::TestWithParam<bool> {};

TEST_P(ModbusBroken, StopsWhenAValueIsNotANumber) {
  const bool serial = GetParam();
  const Expectation expectation = stops({"not_finite"}, period_s);
  fault_case("nan", bench_of(serial), cell_of(expectation), [&] {
    Setting setting(serial, Case{});
    const auto evidence =
        came_about(setting.runs(), [&] { return evidence_of_a_broken_controller(setting); });
    if (evidence) judge(*evidence, expectation);
  });
}

INSTANTIATE_TEST_SUITE_P(, ModbusBroken, testing::Bool(),
                         [](const auto& item) { return std::string(item.param ? "nan_rtu" : "nan_tcp"); });

}  // namespace
}  // namespace upright::test
