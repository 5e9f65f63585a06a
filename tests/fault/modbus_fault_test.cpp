// The fault suite over Modbus: `upright run` against `upright virtual-rig`, each a process of its own. The
// faults of link and encoders are the virtual rig's, those of the machine are done to the controller; the
// record is the virtual rig's own.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <thread>

#include "../integration/virtual_rig_process.hpp"
#include "evidence.hpp"
#include "shim.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/runtime/run_reader.hpp"
#include "upright/runtime/session.hpp"

namespace upright::test {
namespace {

const std::string config = UPRIGHT_SOURCE_DIR "/config/";
constexpr double period_s = 0.005;
constexpr double watchdog_s = 0.1;
constexpr double after_s = 0.5;  // faults begin so long after the controller took over
const std::string after = "0.5";

using Changes = std::vector<std::pair<std::string, std::string>>;

/// A run that balances, for a case to do something to.
struct Running {
  pid_t controller = 0;
  std::vector<std::string> command;  ///< that started it
  std::filesystem::path rig_file;
};

enum class Begins { when_injected, when_done, when_the_shim_strikes, when_the_log_ends, at_the_start };

struct Case {
  const char* fault = "";
  Expectation expectation;
  std::vector<std::string> inject = {};  ///< flags of the virtual rig
  Changes rig = {};                      ///< in the rig file, of both sides
  Changes rig_as_read = {};              ///< in the controller's only
  std::string shim = {};                 ///< UPRIGHT_SHIM of the controller
  std::function<void(const Running&)> action = {};
  Begins begins = Begins::when_injected;
  double duration_s = 1.5;
};

Expectation goes_on() {
  return {true, {}, 0.0};
}
Expectation stops(std::vector<std::string> reasons, double within_s) {
  return {false, std::move(reasons), within_s};
}

std::string shim_words(Disturbance kind, double amount) {
  return std::to_string(static_cast<int>(kind)) + " 0.8 " + std::to_string(amount);
}

void sleep_s(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

std::function<void(const Running&)> standing_still(double for_s) {
  return [for_s](const Running& run) {
    kill(run.controller, SIGSTOP);
    sleep_s(for_s);
    kill(run.controller, SIGCONT);
  };
}

std::function<void(const Running&)> signalled(int number) {
  return [number](const Running& run) { kill(run.controller, number); };
}

void limit(pid_t process, __rlimit_resource resource, rlim_t most) {
  const rlimit limits{most, most};
  EXPECT_EQ(prlimit(process, resource, &limits, nullptr), 0);
}

void grant_no_more_memory(const Running& run) {
  std::ifstream in("/proc/" + std::to_string(run.controller) + "/statm");
  rlim_t pages = 0;
  in >> pages;
  ASSERT_GT(pages, 0u);
  limit(run.controller, RLIMIT_AS, pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)));
}

void start_a_second(const Running& run) {
  Process second(run.command);
  second.rest();
  EXPECT_EQ(second.wait(), 4) << "a device error";
}

void overwrite_rig_file(const Running& run) {
  std::ofstream(run.rig_file) << "backend: none\n";
}

std::vector<Case> link_cases() {
  const auto one_in_20 = [&](const char* fault, const char* flag, std::vector<std::string> more = {}) {
    Case c{.fault = fault, .expectation = goes_on(), .inject = {flag, "20"}};
    c.inject.insert(c.inject.end(), more.begin(), more.end());
    return c;
  };
  const Expectation lost = stops({"link_lost", "stale_encoder"}, watchdog_s + period_s);
  return {
      one_in_20("late", "--inject-late-every", {"--inject-late-ms", "7"}),
      one_in_20("drop", "--inject-drop-every"),
      one_in_20("corrupt", "--inject-corrupt-every"),
      one_in_20("stale", "--inject-stale-every"),
      one_in_20("reorder", "--inject-reorder-every"),
      {.fault = "silent",
       .expectation = lost,
       .inject = {"--inject-drop-every", "1"},
       .begins = Begins::at_the_start},
      {.fault = "always_late",
       .expectation = lost,
       .inject = {"--inject-late-every", "1", "--inject-late-ms", "300"},
       .begins = Begins::at_the_start},
      {.fault = "cut", .expectation = lost, .inject = {"--inject-cut-after", after}},
      {.fault = "restart",
       .expectation = stops({"rig_fault"}, period_s),
       .inject = {"--inject-restart-after", after}},
  };
}

std::vector<Case> encoder_cases() {
  constexpr double noticed_s = 1.1;
  const Expectation runaway = stops({"fell", "track_limit"}, 1.5);
  const auto wrong_sign = [&](const char* fault, const char* from, const char* to) {
    return Case{.fault = fault,
                .expectation = runaway,
                .rig_as_read = {{from, to}},
                .begins = Begins::at_the_start,
                .duration_s = 3.0};
  };
  return {
      {.fault = "stuck_cart",
       .expectation = stops({"stuck_encoder"}, noticed_s),
       .inject = {"--inject-stick", "cart", "--inject-stick-after", after},
       .duration_s = 4.0},
      {.fault = "stuck_pendulum",
       .expectation = stops({"stuck_encoder"}, noticed_s),
       .inject = {"--inject-stick", "pendulum", "--inject-stick-after", after},
       .duration_s = 4.0},
      {.fault = "jump",
       .expectation = stops({"rig_fault"}, 4 * period_s),
       .inject = {"--inject-jump-after", after, "--inject-jump-counts", "5000"}},
      {.fault = "wrap",
       .expectation = goes_on(),
       .rig = {{"width_bits: 32", "width_bits: 16"},
               {"width_bits: 32", "width_bits: 16"},
               {"registers: 2", "registers: 1"},
               {"cart_counts: 0, pendulum_counts: 0", "cart_counts: 32760, pendulum_counts: -32768"}}},
      wrong_sign("sign_amplifier", "limit_v: 15.0, sign: 1", "limit_v: 15.0, sign: -1"),
      wrong_sign("sign_cart", "2.27485e-5, sign: 1", "2.27485e-5, sign: -1"),
      wrong_sign("sign_pendulum", "revolution: 4096, sign: 1", "revolution: 4096, sign: -1"),
  };
}

std::vector<Case> machine_cases() {
  constexpr double log_patience_s = 2.0, round_s = 0.05, long_enough_s = 4.0;
  const Expectation log_stands = stops({"log_failed"}, log_patience_s + round_s);
  return {
      {.fault = "missed_cycles",
       .expectation = goes_on(),
       .action = standing_still(0.02),
       .begins = Begins::when_done},
      // The virtual rig's watchdog takes the voltage away while the controller stands still.
      {.fault = "overrun",
       .expectation = stops({"overrun"}, watchdog_s + period_s),
       .action = standing_still(0.25),
       .begins = Begins::when_done},
      {.fault = "disk_full",
       .expectation = stops({"log_failed"}, round_s),
       .action = [](const Running& run) { limit(run.controller, RLIMIT_FSIZE, 70'000); },
       .begins = Begins::when_the_log_ends,
       .duration_s = 8.0},
      {.fault = "slow_disk", .expectation = goes_on(), .shim = shim_words(Disturbance::slow_writes, 0.3)},
      {.fault = "dead_disk",
       .expectation = log_stands,
       .shim = shim_words(Disturbance::one_slow_write, 3.0),
       .begins = Begins::when_the_shim_strikes,
       .duration_s = long_enough_s},
      {.fault = "writer_killed",
       .expectation = log_stands,
       .shim = shim_words(Disturbance::kill_writer, 0.0),
       .begins = Begins::when_the_shim_strikes,
       .duration_s = long_enough_s},
      {.fault = "sigterm",
       .expectation = stops({"signal"}, period_s),
       .action = signalled(SIGTERM),
       .begins = Begins::when_done},
      {.fault = "clock_step", .expectation = goes_on(), .shim = shim_words(Disturbance::step_clock, 3600.0)},
      {.fault = "memory",
       .expectation = goes_on(),
       .action = grant_no_more_memory,
       .begins = Begins::when_done},
      {.fault = "two_controllers",
       .expectation = goes_on(),
       .action = start_a_second,
       .begins = Begins::when_done},
      {.fault = "rig_file_changed",
       .expectation = goes_on(),
       .action = overwrite_rig_file,
       .begins = Begins::when_done},
  };
}

struct On {
  Case what;
  bool serial;
};

void PrintTo(const On& on, std::ostream* out) {
  *out << on.what.fault << (on.serial ? " over RTU" : " over TCP");
}

std::vector<On> all() {
  std::vector<On> list;
  for (const std::vector<Case>& cases : {link_cases(), encoder_cases(), machine_cases()})
    for (const Case& c : cases)
      for (const bool serial : {false, true}) list.push_back({c, serial});
  return list;
}

/// The rig and its controller's files, for either link.
class Setting {
 public:
  Setting(bool serial, const Changes& both, const Changes& controllers, const std::vector<std::string>& flags)
      : serial_(serial) {
    // The machine may be busy: what is tested here is what is done, not how fast.
    rig_ = changed(
        text_of(config + "rigs/" + (serial ? "modbus-rtu.yaml" : "modbus-tcp.yaml")),
        {{serial ? "response_timeout_s: 0.002" : "response_timeout_s: 0.0008", "response_timeout_s: 0.003"}});
    rig_ = changed(rig_, both);
    server_ = std::make_unique<VirtualRigProcess>(folder_, rig_, serial, flags);
    std::ofstream(rig_file()) << changed(
        serial ? replaced(rig_, "/dev/ttyUSB0", server_->name())
               : replaced(rig_, "port: 1502", "port: " + std::to_string(server_->port())),
        controllers);
    std::ofstream(gain_file()) << replaced(text_of(config + "gains/exponential.yaml"), "sample_rate_hz: 1000",
                                           "sample_rate_hz: 200");
  }
  std::filesystem::path rig_file() const { return folder_ / "rig.yaml"; }
  std::filesystem::path gain_file() const { return folder_ / "gains.yaml"; }
  std::filesystem::path runs() const { return folder_ / "runs"; }
  std::filesystem::path mark() const { return folder_ / "struck"; }
  std::vector<std::string> command(double duration_s) const {
    return {UPRIGHT_BINARY, "run",       "--rig",      rig_file(),
            "--gains",      gain_file(), "--duration", std::to_string(duration_s),
            "--out",        runs(),      "--json"};
  }
  VirtualRigProcess& server() { return *server_; }

 private:
  static std::string changed(std::string text, const Changes& changes) {
    for (const auto& [from, to] : changes) text = replaced(text, from, to);
    return text;
  }

  bool serial_;
  Folder folder_;
  std::string rig_;
  std::unique_ptr<VirtualRigProcess> server_;
};

std::vector<PlantRow> plant_rows(const std::vector<TraceRow>& trace) {
  std::vector<PlantRow> rows;
  rows.reserve(trace.size());
  for (const TraceRow& row : trace) rows.push_back({row.time_s, row.voltage_v, row.cart_m});
  return rows;
}

/// When the virtual rig let the pendulum go.
double let_go_s(const std::vector<TraceRow>& trace) {
  for (const TraceRow& row : trace)
    if (!row.held) return row.time_s;
  return 0.0;
}

double log_end_s(const std::filesystem::path& run) {
  const RunRecord record = read_run(run);
  return record.outcome->number("started_monotonic_s", Range{}) +
         1e-9 * static_cast<double>(record.samples.rows.back().time_ns);
}

double begin_of(const Case& c, Setting& setting, double done_s, const std::filesystem::path& run) {
  const double first_s = let_go_s(setting.server().trace());
  switch (c.begins) {
    case Begins::when_injected:
      return first_s + after_s;
    case Begins::when_done:
      return done_s;
    case Begins::when_the_shim_strikes:
      return std::stod(text_of(setting.mark()));
    case Begins::when_the_log_ends:
      return log_end_s(run);
    case Begins::at_the_start:
      break;
  }
  return first_s;
}

std::optional<Evidence> evidence_of(const On& on, const std::unique_ptr<Setting>& setting) {
  const Case& c = on.what;
  std::vector<std::string> command = setting->command(c.duration_s);
  const Running running_command{0, command, setting->rig_file()};
  if (!c.shim.empty())
    command.insert(command.begin(), {"env", "LD_PRELOAD=" UPRIGHT_SHIM_LIBRARY, "UPRIGHT_SHIM=" + c.shim,
                                     "UPRIGHT_SHIM_MARK=" + setting->mark().string()});
  Process controller(command);
  double done_s = 0.0;
  if (c.action) {
    if (!wait_for_rows(setting->runs())) return std::nullopt;
    sleep_s(0.3);
    Running running = running_command;
    running.controller = controller.id();
    done_s = monotonic_s();
    c.action(running);
  }
  controller.rest();
  controller.wait();
  sleep_s(watchdog_s);
  setting->server().end();
  if (!c.shim.empty()) {
    EXPECT_TRUE(std::filesystem::exists(setting->mark())) << "the shim struck";
  }
  Evidence evidence;
  evidence.run = only_entry(setting->runs());
  evidence.plant = plant_rows(setting->server().trace());
  evidence.fault_s = begin_of(c, *setting, done_s, evidence.run);
  evidence.log_may_end = c.begins == Begins::when_the_log_ends;
  return evidence;
}

class ModbusFault : public testing::TestWithParam<On> {};

TEST_P(ModbusFault, HasItsOutcome) {
  const On& on = GetParam();
  const Case& c = on.what;
  for (int attempt = 0; attempt < 3; ++attempt) {
    const auto setting = std::make_unique<Setting>(on.serial, c.rig, c.rig_as_read, c.inject);
    const std::optional<Evidence> evidence = evidence_of(on, setting);
    ASSERT_TRUE(evidence.has_value()) << "the run does not begin";
    if (attempt < 2 && machine_was_too_busy(*evidence, c.expectation)) continue;
    judge(*evidence, c.expectation);
    break;
  }
  if (!HasFailure())
    record(c.fault, on.serial ? Bench::modbus_rtu : Bench::modbus_tcp, cell_of(c.expectation));
}

INSTANTIATE_TEST_SUITE_P(, ModbusFault, testing::ValuesIn(all()), [](const auto& item) {
  return std::string(item.param.what.fault) + (item.param.serial ? "_rtu" : "_tcp");
});

class ModbusKilled : public testing::TestWithParam<bool> {};

TEST_P(ModbusKilled, IsAtZeroVoltsByTheDevicesWatchdog) {
  const bool serial = GetParam();
  Setting setting(serial, {}, {}, {});
  Process controller(setting.command(60.0));
  ASSERT_TRUE(wait_for_rows(setting.runs()));
  sleep_s(0.3);
  const double killed_s = monotonic_s();
  controller.end(SIGKILL);
  sleep_s(2 * watchdog_s);
  setting.server().end();
  double on_until_s = 0.0;
  const std::vector<TraceRow> trace = setting.server().trace();
  for (const TraceRow& row : trace)
    if (row.voltage_v != 0.0) on_until_s = row.time_s;
  EXPECT_GT(on_until_s, 0.0);
  EXPECT_LT(on_until_s - killed_s, watchdog_s + 0.05);
  EXPECT_FALSE(read_run(only_entry(setting.runs())).samples.rows.empty()) << "the log reads";
  if (!HasFailure())
    record("sigkill", serial ? Bench::modbus_rtu : Bench::modbus_tcp,
           "the device's watchdog: 0 V within 100 ms");
}

INSTANTIATE_TEST_SUITE_P(, ModbusKilled, testing::Bool(), [](const auto& item) {
  return std::string(item.param ? "sigkill_rtu" : "sigkill_tcp");
});

/// An estimate that is not a number, from a cycle on.
class BrokenCompensator final : public DelayCompensator {
 public:
  explicit BrokenCompensator(std::atomic<double>& began_s) : began_s_(began_s) {}
  void start(const ControlState&) noexcept override {}
  ControlState compensate(const ControlState& delayed, double) noexcept override {
    ControlState state = delayed;
    constexpr int bad = 100;
    if (++cycle_ == bad) began_s_ = monotonic_s();
    if (cycle_ >= bad) state.cart_velocity_mps = std::numeric_limits<double>::quiet_NaN();
    return state;
  }

 private:
  std::atomic<double>& began_s_;
  int cycle_ = 0;
};

class ModbusBroken : public testing::TestWithParam<bool> {};

/// The program has no way to be told to compute nonsense: here the session is run in this process.
TEST_P(ModbusBroken, StopsWhenAValueIsNotANumber) {
  const bool serial = GetParam();
  Setting setting(serial, {}, {}, {});
  RunSetup setup;
  setup.command = "modbus_fault_test";
  setup.label = "nan";
  setup.duration_s = 1.5;
  setup.control = read_gain_file(setting.gain_file());
  setup.rig = read_rig_file(setting.rig_file());
  setup.limits = {300, setup.rig.track_limit_m, setup.rig.fall_angle_rad, setup.rig.watchdog_s,
                  default_periods_late(period_s)};
  MonotonicClock clock;
  const SignalFlag signal{0};
  const auto rig = make_rig(setup.rig, {period_s});
  rig->open();
  SessionOptions options;
  options.out = setting.runs();
  std::atomic<double> began_s{0.0};
  options.compensator = std::make_unique<BrokenCompensator>(began_s);
  const SessionResult result = run_session(setup, *rig, clock, signal, std::move(options));
  sleep_s(watchdog_s);
  setting.server().end();
  const Expectation expectation = stops({"not_finite"}, period_s);
  judge({plant_rows(setting.server().trace()), began_s, result.directory, false, false}, expectation);
  if (!HasFailure()) record("nan", serial ? Bench::modbus_rtu : Bench::modbus_tcp, cell_of(expectation));
}

INSTANTIATE_TEST_SUITE_P(, ModbusBroken, testing::Bool(),
                         [](const auto& item) { return std::string(item.param ? "nan_rtu" : "nan_tcp"); });

}  // namespace
}  // namespace upright::test
