// `upright run` over the real links against the virtual rig: it balances without a fault; with faults it goes
// on or is at zero volts within the watchdog's time, seen from the plant's side, and the log says which cycle
// was the first.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <random>
#include <sstream>
#include <thread>

#include "tests/support/run_end.hpp"
#include "virtual_rig_process.hpp"

namespace upright::test {
namespace {

const std::string config = UPRIGHT_SOURCE_DIR "/config/";

/// Seconds each run lasts; UPRIGHT_SECONDS makes them others.
double duration_s() {
  const char* seconds = std::getenv("UPRIGHT_SECONDS");
  return seconds != nullptr ? std::stod(seconds) : 30.0;
}

/// So long after the controller took over the device restarts: soon, for a busy machine ends many a long run
/// before.
const std::string restart_after_s = "2";

constexpr double watchdog_s = 0.1;
constexpr double scheduling_margin_s = 0.05;

struct Outcome {
  int exit_code = -1;
  std::string said;
  std::string run_yaml, samples;
  std::vector<TraceRow> trace;

  RunEnd end() const { return run_end(run_yaml).value(); }
};

enum class Must { balance, go_on_or_stop, stop };

struct Case {
  const char* name;
  bool serial;
  Must must;
  std::vector<std::string> flags;
  double stall_s = 0.0;  ///< the controller stands still for so long once the motor is on
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.name;
}

Outcome run(const Case& c) {
  Folder folder;
  std::string rig = text_of(config + "rigs/" + (c.serial ? "modbus-rtu.yaml" : "modbus-tcp.yaml"));
  VirtualRigProcess server(folder, rig, c.serial, c.flags);
  rig = c.serial ? replaced(rig, "/dev/ttyUSB0", server.name())
                 : replaced(rig, "port: 1502", "port: " + std::to_string(server.port()));
  std::ofstream(folder / "rig.yaml") << rig;
  std::ofstream(folder / "gains.yaml")
      << (c.serial ? text_of(config + "gains/exponential-200hz.yaml")
                   : replaced(text_of(config + "gains/exponential.yaml"), "sample_rate_hz: 1000",
                              "sample_rate_hz: 500"));
  Process client({UPRIGHT_BINARY, "run", "--rig", folder / "rig.yaml", "--gains", folder / "gains.yaml",
                  "--duration", std::to_string(duration_s()), "--out", folder / "run", "--json",
                  "--unchecked"});
  if (c.stall_s > 0.0 && wait_for_rows(folder / "run")) {
    kill(client.id(), SIGSTOP);
    std::this_thread::sleep_for(std::chrono::duration<double>(c.stall_s));
    kill(client.id(), SIGCONT);
  }
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

struct Row {
  std::uint64_t tick = 0;
  double time_s = 0.0;
  std::int64_t cart_counts = 0, pendulum_counts = 0;
  double cart_m = 0.0, read_s = 0.0;
  std::uint32_t flags = 0;
  std::uint64_t sequence = 0;
  bool held() const { return (flags & 3u) != 0; }                      // stale or fault
  bool late() const { return (flags & (8u | 16u | 32u | 64u)) != 0; }  // it ended after the next was due
  bool after_missed() const { return (flags & 128u) != 0; }
  bool write_failed() const { return (flags & 256u) != 0; }
  bool stopped() const { return (flags & 512u) != 0; }
};

std::vector<Row> rows_of(const std::string& samples) {
  std::istringstream lines(samples);
  std::string line;
  std::getline(lines, line);
  std::vector<Row> rows;
  while (std::getline(lines, line)) {
    std::vector<std::string> cells;
    std::istringstream words(line);
    for (std::string cell; std::getline(words, cell, ',');) cells.push_back(cell);
    if (cells.size() != 16) throw std::runtime_error("not a row: " + line);
    rows.push_back({std::stoull(cells[0]), std::stod(cells[1]), std::stoll(cells[2]), std::stoll(cells[3]),
                    std::stod(cells[4]), 1e-6 * std::stod(cells[11]),
                    static_cast<std::uint32_t>(std::stoul(cells[14])), std::stoull(cells[15])});
  }
  return rows;
}

/// The number behind "KEY: " in run.yaml's outcome.
double outcome_number(const std::string& yaml, const std::string& key) {
  const std::size_t outcome = yaml.find("\noutcome:");
  const std::size_t at = yaml.find("  " + key + ": ", outcome);
  if (outcome == std::string::npos || at == std::string::npos)
    throw std::runtime_error("run.yaml's outcome has no " + key);
  return std::stod(yaml.substr(at + key.size() + 4));
}

/// Every fresh row against what the plant did while it was read; every other row repeats the last fresh one
/// and says so.
void expect_no_old_count(const Outcome& outcome, const std::vector<Row>& rows, bool is_certain) {
  const double start_s = outcome_number(outcome.run_yaml, "started_monotonic_s");
  std::uint64_t sequence = 0;
  std::int64_t counts = 0;
  std::size_t fresh = 0, wrong = 0;
  for (const Row& row : rows) {
    if (row.held()) {
      EXPECT_EQ(row.sequence, sequence) << "cycle " << row.tick;
      EXPECT_EQ(row.cart_counts, counts) << "cycle " << row.tick;
      continue;
    }
    EXPECT_GT(row.sequence, sequence) << "cycle " << row.tick;
    sequence = row.sequence;
    counts = row.cart_counts;
    ++fresh;
    const double within_s = 0.001 + row.read_s;  // the time is that of the middle of the exchange
    const CartRange range =
        cart_between(outcome.trace, start_s + row.time_s - within_s, start_s + row.time_s + within_s);
    if (!range.holds(row.cart_m)) ++wrong;
  }
  EXPECT_GT(fresh, 0u);
  EXPECT_EQ(is_certain ? wrong : 0u, 0u) << "of " << fresh;
}

/// The cycle that the outcome names is the first of the trouble and the log's row of it says so; a cycle that
/// never was has no row, and the row after it says that. Or it is the first in which an encoder was silent,
/// and then it was silent to the end. The plant had its zero volts within the watchdog's time of the trouble,
/// or of the row that ended the run where trouble takes time to notice: silence, and a few late periods.
void expect_named_stop(const Outcome& outcome, const std::vector<Row>& rows) {
  const double start_s = outcome_number(outcome.run_yaml, "started_monotonic_s");
  const auto tick = static_cast<std::uint64_t>(outcome_number(outcome.run_yaml, "tick"));
  ASSERT_FALSE(rows.empty());
  EXPECT_TRUE(rows.back().stopped());
  const auto named = std::find_if(rows.begin(), rows.end(), [&](const Row& row) { return row.tick >= tick; });
  ASSERT_NE(named, rows.end()) << "cycle " << tick << " is not in the log";
  const bool overrun = outcome.end().reason == "overrun", silent = outcome.end().reason == "stuck_encoder";
  if (!overrun || !named->after_missed()) {
    EXPECT_EQ(named->tick, tick);
  }
  if (silent) {
    const auto keeps = [&](auto counts) {
      return std::all_of(named, rows.end(), [&](const Row& row) { return counts(row) == counts(*named); });
    };
    EXPECT_TRUE(keeps([](const Row& row) { return row.cart_counts; }) ||
                keeps([](const Row& row) { return row.pendulum_counts; }))
        << "cycle " << tick;
  } else if (overrun) {
    EXPECT_TRUE(named->late() || named->after_missed()) << "cycle " << tick;
  } else {
    EXPECT_TRUE(named->held() || named->write_failed() || named->stopped()) << "cycle " << tick;
  }
  EXPECT_NE(outcome.run_yaml.find("in cycle " + std::to_string(tick)), std::string::npos);
  double on_until_s = 0.0;
  for (const TraceRow& row : outcome.trace)
    if (row.voltage_v != 0.0) on_until_s = row.time_s;
  const double trouble_s = silent || overrun ? rows.back().time_s : named->time_s;
  EXPECT_TIMING((Interval{start_s + trouble_s, on_until_s}),
                on_until_s - (start_s + trouble_s) < watchdog_s + scheduling_margin_s, "zero volts in time");
}

/// One of the counts in run.yaml.
long long count_in(const Outcome& outcome, const std::string& key) {
  const std::string& text = outcome.run_yaml;
  const std::size_t counts = text.find("\n  counts: {");
  const std::size_t at = counts == std::string::npos ? counts : text.find(key + ": ", counts);
  if (at == std::string::npos) throw std::runtime_error("no " + key + " in " + text);
  return std::stoll(text.substr(at + key.size() + 2));
}

class RunOverModbus : public testing::TestWithParam<Case> {};

void judge(const Case& c, const Outcome& outcome) {
  const std::string name = c.name;
  const bool restarts = name.find("restart") != std::string::npos;
  if (c.must == Must::balance) EXPECT_END(outcome.end(), outcome.exit_code == 0);
  if (restarts) EXPECT_END(outcome.end(), outcome.run_yaml.find("restarted") != std::string::npos);
  ASSERT_FALSE(outcome.trace.empty());
  EXPECT_EQ(outcome.trace.back().voltage_v, 0.0) << "the motor is off in the end";
  const std::vector<Row> rows = rows_of(outcome.samples);
  // A wrong bit in a TCP reply has no check sum to betray it; only what no motion explains is refused.
  expect_no_old_count(outcome, rows, name != "tcp_corrupt");
  const auto held = std::count_if(rows.begin(), rows.end(), [](const Row& row) { return row.held(); });
  const auto counted = [&](const std::string& key) { return count_in(outcome, key); };
  EXPECT_EQ(held, counted("stale") + counted("faults")) << "each faulty cycle is marked in the log";
  long long explained = 0;
  for (const char* cause : {"late_reply", "no_reply", "no_connection", "wrong_reply", "refused", "other"})
    explained += counted(cause);
  // The row of a stop that came before the reading asks the link for nothing: a cycle too late to be given a
  // voltage, or a log that the disk holds up.
  const bool never_asked = rows.back().stopped() && rows.back().held() && rows.back().read_s == 0.0;
  EXPECT_EQ(held - (never_asked ? 1 : 0), explained) << "each has its cause";
  if (outcome.exit_code == 0 && counted("no_reply") > 0) {
    EXPECT_GT(counted("recoveries"), 0) << "it went on because the link came back";
  }
  // Where no reply comes any more nobody may know of zero volts, though the device's watchdog sees to it.
  const bool confirmed = outcome.run_yaml.find("zero_volts: confirmed") != std::string::npos;
  const int stopped_code = confirmed ? 3 : 4;
  if (c.must == Must::stop) {
    EXPECT_EQ(outcome.exit_code, stopped_code) << outcome.said;
  }
  if (outcome.exit_code == 0) {
    EXPECT_GT(rows.back().time_s, 0.99 * duration_s());
    return;
  }
  EXPECT_EQ(outcome.exit_code, stopped_code) << outcome.said << outcome.run_yaml;
  expect_named_stop(outcome, rows);
}

TEST_P(RunOverModbus, BalancesOrStopsAtZeroVolts) {
  const Case& c = GetParam();
  in_real_time([&] { judge(c, run(c)); });
}

/// A rig as it is found: the pendulum hangs, with its zero taken there, and somebody lifts it while the
/// program waits.
TEST(RunFromHanging, WaitsAtZeroVoltsUntilThePendulumIsHeldUpright) {
  in_real_time([] {
    const Folder folder;
    std::string rig = replaced(text_of(config + "rigs/modbus-tcp.yaml"),
                               "zero: {at: counts, cart_counts: 0, pendulum_counts: 0, pose: upright}",
                               "zero: {at: start, pose: hanging}");
    VirtualRigProcess server(folder, rig, false, {"--hang", "1", "--theta0-deg", "2"});
    std::ofstream(folder / "rig.yaml")
        << replaced(rig, "port: 1502", "port: " + std::to_string(server.port()));
    std::ofstream(folder / "gains.yaml") << replaced(text_of(config + "gains/exponential.yaml"),
                                                     "sample_rate_hz: 1000", "sample_rate_hz: 500");
    const std::vector<std::string> command = {
        UPRIGHT_BINARY, "run", "--rig", folder / "rig.yaml", "--gains", folder / "gains.yaml",
        "--duration",   "3",   "--out", folder / "run",      "--json",  "--unchecked"};
    Process client(command);
    const std::string said = client.rest();
    const int exit_code = client.wait();
    server.end();
    const std::string yaml = text_of(only_entry(folder / "run") / "run.yaml");
    EXPECT_END(run_end(yaml).value(), exit_code == 0);
    double lifted_s = 0.0, on_s = 0.0, on_until_s = 0.0;
    for (const TraceRow& row : server.trace()) {
      if (lifted_s == 0.0 && std::abs(row.theta_rad) < 0.1) lifted_s = row.time_s;
      if (row.voltage_v != 0.0 && on_s == 0.0) on_s = row.time_s;
      if (row.voltage_v != 0.0) on_until_s = row.time_s;
    }
    ASSERT_GT(lifted_s, 0.0);
    EXPECT_GT(on_s, lifted_s + 0.45) << "it is held for half a second before the motor comes on";
    EXPECT_GT(on_until_s - on_s, 2.7) << "and then balanced";
  });
}

TEST(RunFromHanging, GivesUpAfterTheWaitAndSaysThatItFell) {
  const Folder folder;
  const std::string rig = text_of(config + "rigs/modbus-tcp.yaml");
  VirtualRigProcess server(folder, rig, false, {"--theta0-deg", "180"});
  std::ofstream(folder / "rig.yaml") << replaced(rig, "port: 1502", "port: " + std::to_string(server.port()));
  std::ofstream(folder / "gains.yaml")
      << replaced(text_of(config + "gains/exponential.yaml"), "sample_rate_hz: 1000", "sample_rate_hz: 500");
  for (const char* wait_s : {"0", "0.7"}) {
    Process client({UPRIGHT_BINARY, "run", "--rig", folder / "rig.yaml", "--gains", folder / "gains.yaml",
                    "--duration", "3", "--wait", wait_s, "--out", folder / "run", "--json", "--unchecked"});
    const std::string said = client.rest();
    EXPECT_EQ(client.wait(), 3);
    EXPECT_NE(said.find("\"reason\": \"fell\""), std::string::npos) << said;
    EXPECT_NE(said.find("\"fresh\": 1,"), std::string::npos) << "one reading is enough: " << said;
  }
  server.end();
  for (const TraceRow& row : server.trace()) EXPECT_EQ(row.voltage_v, 0.0);
}

struct Started {
  Folder folder;
  std::unique_ptr<VirtualRigProcess> server;
  std::vector<std::string> command;
};

/// A virtual rig over TCP, and the command that runs on it, into the folder "run".
std::unique_ptr<Started> start_rig() {
  auto started = std::make_unique<Started>();
  const std::string rig = text_of(config + "rigs/modbus-tcp.yaml");
  started->server = std::make_unique<VirtualRigProcess>(started->folder, rig, false);
  const std::filesystem::path rig_file = started->folder / "rig.yaml", gains = started->folder / "gains.yaml";
  std::ofstream(rig_file) << replaced(rig, "port: 1502", "port: " + std::to_string(started->server->port()));
  std::ofstream(gains) << replaced(text_of(config + "gains/exponential.yaml"), "sample_rate_hz: 1000",
                                   "sample_rate_hz: 500");
  started->command = {UPRIGHT_BINARY, "run",        "--rig", rig_file, "--gains",
                      gains,          "--duration", "60",    "--out",  started->folder / "run",
                      "--unchecked"};
  return started;
}

void kill_after(double alive_s) {
  const auto started = start_rig();
  const std::filesystem::path runs = started->folder / "run";
  Process client(started->command);
  ASSERT_TRUE(wait_for_rows(runs));
  std::this_thread::sleep_for(std::chrono::duration<double>(alive_s));
  const double killed_s = monotonic_s();
  client.end(SIGKILL);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  started->server->end();
  const std::filesystem::path run = only_entry(runs);
  if (const auto end = run_end(text_of(run / "run.yaml"))) EXPECT_END(*end, false);
  double let_go_s = 0.0, on_until_s = 0.0;
  for (const TraceRow& row : started->server->trace()) {
    if (row.voltage_v == 0.0) continue;
    if (let_go_s == 0.0) let_go_s = row.time_s;
    on_until_s = row.time_s;
  }
  ASSERT_GT(let_go_s, 0.0);
  EXPECT_TIMING((Interval{killed_s, on_until_s}), on_until_s - killed_s < watchdog_s + scheduling_margin_s,
                "the device's watchdog");
  std::string samples = text_of(run / "samples.csv");
  samples.resize(samples.rfind('\n') + 1);
  const std::vector<Row> rows = rows_of(samples);
  ASSERT_FALSE(rows.empty());
  constexpr double period_s = 0.002, may_be_missing_s = 0.1;
  EXPECT_TIMING((Interval{killed_s - 2 * may_be_missing_s, killed_s}),
                rows.back().time_s + 2 * period_s > killed_s - let_go_s - may_be_missing_s,
                "rows of the last moment only are missing");
  for (const char* verb : {"report", "replay"}) {
    Process reader({UPRIGHT_BINARY, verb, run});
    const std::string said = reader.rest();
    EXPECT_EQ(reader.wait(), 0) << said;
  }
  EXPECT_TRUE(std::filesystem::exists(run / "report.html"));
}

/// The plant knows when the first voltage came, which is when the log's time begins, and the test knows when
/// it killed: no row between them that is older than a tenth of a second may be missing.
TEST(KilledRun, KeepsEveryRowOlderThanATenthOfASecondAndItsReport) {
  std::mt19937 random(std::random_device{}());
  std::uniform_real_distribution<double> moment_s(0.0, 1.0);
  constexpr int kills = 8;
  for (int i = 0; i < kills && !IsSkipped(); ++i) {
    const double alive_s = moment_s(random);
    SCOPED_TRACE("killed " + std::to_string(alive_s) + " s after its first rows");
    in_real_time([&] { kill_after(alive_s); });
  }
}

void signal_run(int signal_number) {
  const auto started = start_rig();
  Process client(started->command);
  ASSERT_TRUE(wait_for_rows(started->folder / "run"));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  const double signalled_s = monotonic_s();
  EXPECT_EQ(client.end(signal_number), 3);
  started->server->end();
  const RunEnd end = run_end(text_of(only_entry(started->folder / "run") / "run.yaml")).value();
  EXPECT_END(end, end.reason == "signal");
  double on_until_s = 0.0;
  for (const TraceRow& row : started->server->trace())
    if (row.voltage_v != 0.0) on_until_s = row.time_s;
  ASSERT_GT(on_until_s, 0.0) << "the motor was on";
  // A period, the exchange that carries the zero volts, and what a busy machine adds.
  constexpr double period_s = 0.002, busy_s = 0.015;
  EXPECT_TIMING((Interval{signalled_s, on_until_s}), on_until_s - signalled_s < period_s + busy_s,
                "zero volts in time");
}

TEST(Signalled, IsAtZeroVoltsInAPeriodWithACompleteRunDirectory) {
  for (const int signal_number : {SIGINT, SIGTERM})
    if (!IsSkipped()) in_real_time([&] { signal_run(signal_number); });
}

/// A file system of half a megabyte, in a mount name space of its own.
void fill_the_disk() {
  const auto started = start_rig();
  const std::filesystem::path disk = started->folder / "run";
  std::filesystem::create_directory(disk);
  std::string command;
  for (const std::string& word : started->command) command += "'" + word + "' ";
  const std::string kept = started->folder / "kept";
  const std::string script = "mount -t tmpfs -o size=500k none '" + disk.string() + "' || exit 77\n" +
                             command + "--json 2>&1\nstatus=$?\ncp -r '" + disk.string() + "' '" + kept +
                             "'\nexit $status\n";
  std::vector<std::string> own_space = {"unshare", "--mount", "sh", "-c", script};
  // A user name space would cost root its real-time scheduling, and get everybody else this far.
  if (geteuid() != 0) own_space.insert(own_space.begin() + 1, "--map-root-user");
  Process client(own_space);
  const std::string said = client.rest();
  const int status = client.wait();
  started->server->end();
  if (status != 3 && said.find("rows_written") == std::string::npos)
    GTEST_SKIP() << "NOT TESTED: a mount name space cannot be created on this machine: " << said;
  EXPECT_EQ(status, 3) << said;
  EXPECT_EQ(started->server->trace().back().voltage_v, 0.0);
  const std::filesystem::path run = only_entry(kept);
  const RunEnd end = run_end(text_of(run / "run.yaml")).value();
  EXPECT_END(end, end.reason == "log_failed");
  const std::vector<Row> rows = rows_of(text_of(run / "samples.csv"));
  EXPECT_GT(rows.size(), 1000u);
  for (std::size_t i = 0; i < rows.size(); ++i) ASSERT_LE(i, rows[i].tick);
  Process reader({UPRIGHT_BINARY, "report", run});
  EXPECT_NE(reader.rest().find("report.html"), std::string::npos);
  EXPECT_EQ(reader.wait(), 0);
}

TEST(FullDisk, StopsTheMotorAndKeepsTheRows) {
  in_real_time(fill_the_disk);
}

void remove_run() {
  const auto started = start_rig();
  std::string command;
  for (const std::string& word : started->command) command += "'" + word + "' ";
  Process client({"sh", "-c", command + "2>&1"});
  const Since driven;
  ASSERT_TRUE(wait_for_rows(started->folder / "run"));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const double removed_s = monotonic_s();
  std::filesystem::remove_all(only_entry(started->folder / "run"));
  const std::string said = client.rest();
  EXPECT_EQ(client.wait(), 3) << said;
  // How it ended otherwise went with its folder.
  EXPECT_TIMING(driven.until_now(), said.find("was removed during the run") != std::string::npos, said);
  started->server->end();
  double on_until_s = 0.0;
  for (const TraceRow& row : started->server->trace())
    if (row.voltage_v != 0.0) on_until_s = row.time_s;
  ASSERT_GT(on_until_s, 0.0) << "the motor was on";
  constexpr double looks_every_s = 0.05, busy_s = 0.2;
  EXPECT_TIMING((Interval{removed_s, on_until_s}), on_until_s - removed_s < looks_every_s + busy_s,
                "zero volts in time");
}

TEST(RemovedRun, StopsTheMotorAndIsNoSuccess) {
  in_real_time(remove_run);
}

TEST(VirtualRig, WritesItsTraceToTheEndWhenItsTerminalGoesAway) {
  in_real_time([] {
    const auto started = start_rig();
    Process client(started->command);
    ASSERT_TRUE(wait_for_rows(started->folder / "run"));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    const double hung_up_s = monotonic_s();
    EXPECT_EQ(started->server->end(SIGHUP), 0);
    client.end(SIGTERM);
    const std::vector<TraceRow> trace = started->server->trace();
    ASSERT_FALSE(trace.empty());
    constexpr double busy_s = 0.2;
    EXPECT_TIMING((Interval{hung_up_s - busy_s, hung_up_s}), trace.back().time_s > hung_up_s - busy_s,
                  "the trace goes to the end");
    EXPECT_EQ(text_of(started->folder / "trace.csv").back(), '\n') << "the last line is whole";
  });
}

INSTANTIATE_TEST_SUITE_P(
    Links, RunOverModbus,
    testing::Values(
        Case{"tcp", false, Must::balance, {}}, Case{"rtu", true, Must::balance, {}},
        Case{"tcp_late", false, Must::go_on_or_stop, {"--inject-late-every", "300", "--inject-late-ms", "5"}},
        Case{"rtu_late", true, Must::go_on_or_stop, {"--inject-late-every", "300", "--inject-late-ms", "5"}},
        Case{"tcp_drop", false, Must::go_on_or_stop, {"--inject-drop-every", "300"}},
        Case{"rtu_drop", true, Must::go_on_or_stop, {"--inject-drop-every", "300"}},
        Case{"tcp_corrupt", false, Must::go_on_or_stop, {"--inject-corrupt-every", "300"}},
        Case{"rtu_corrupt", true, Must::go_on_or_stop, {"--inject-corrupt-every", "300"}},
        Case{"tcp_stalled", false, Must::stop, {}, 0.3}, Case{"rtu_stalled", true, Must::stop, {}, 0.3},
        Case{"tcp_restart", false, Must::stop, {"--inject-restart-after", restart_after_s}},
        Case{"rtu_restart", true, Must::stop, {"--inject-restart-after", restart_after_s}},
        // Nothing comes back any more: the motor may not go on with the last voltage.
        Case{"tcp_silent", false, Must::stop, {"--inject-drop-every", "1"}},
        Case{"rtu_silent", true, Must::stop, {"--inject-drop-every", "1"}},
        Case{"tcp_always_late", false, Must::stop, {"--inject-late-every", "1", "--inject-late-ms", "300"}},
        Case{"rtu_always_late", true, Must::stop, {"--inject-late-every", "1", "--inject-late-ms", "300"}},
        Case{"rtu_all_corrupt", true, Must::stop, {"--inject-corrupt-every", "1"}}),
    [](const auto& item) { return std::string(item.param.name); });

}  // namespace
}  // namespace upright::test
