// The fault suite on a board: `upright run` drives a plant behind the emulated board, whose pins the plant
// sees and which is what judges it.
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "../fault/broken_run.hpp"
#include "../fault/evidence.hpp"
#include "board_setting.hpp"
#include "upright/record/run_reader.hpp"

namespace upright::test {
namespace {

constexpr double period_s = 0.005;
constexpr double watchdog_s = 0.1;
constexpr double processor_watchdog_s = 0.016;

struct Case {
  ProcessCase process;
  LineFaults line = {};
  Mishap mishap = Mishap::none;
  bool cuts = false;
  const char* cause = "";  ///< a part of the run's sentence
  const char* more = "";   ///< of the test's name, where a fault has several
  LoopClock clock = LoopClock::computer;
};

Case on_the_line(const char* fault, const LineFaults& line) {
  return {.process = {.fault = fault, .expectation = goes_on()}, .line = line};
}

Case mishap(const char* fault, Mishap what, const char* cause, Expectation expectation,
            const char* more = "") {
  constexpr double long_enough_s = 4.0;
  return {.process = {.fault = fault,
                      .expectation = std::move(expectation),
                      .begins = Begins::when_done,
                      .duration_s = long_enough_s},
          .mishap = what,
          .cause = cause,
          .more = more};
}

std::vector<Case> line_cases() {
  const Expectation lost = stops({"link_lost", "stale_encoder"}, watchdog_s + period_s);
  std::vector<Case> cases = {
      on_the_line("late", {.late_replies_every = 20, .late_s = 0.007}),
      on_the_line("drop", {.drop_replies_every = 20}),
      on_the_line("corrupt", {.corrupt_replies_every = 20}),
      on_the_line("corrupt_request", {.corrupt_requests_every = 20}),
      on_the_line("noise", {.noise_every = 20}),
  };
  cases.push_back({.process = {.fault = "silent", .expectation = lost, .begins = Begins::at_the_start},
                   .line = {.drop_replies_every = 1}});
  cases.push_back({.process = {.fault = "always_late", .expectation = lost, .begins = Begins::at_the_start},
                   .line = {.late_replies_every = 1, .late_s = 0.3}});
  cases.push_back(
      {.process = {.fault = "cut", .expectation = lost, .begins = Begins::when_done}, .cuts = true});
  return cases;
}

std::vector<Case> device_cases() {
  const Expectation stuck = stops({"stuck_encoder"}, stuck_noticed_s);
  const Expectation at_once = stops({"rig_fault"}, period_s);
  const Expectation at_the_track_end = stops({"track_limit"}, period_s);
  return {
      mishap("stuck_cart", Mishap::cart_sticks, "the cart encoder did not count", stuck),
      mishap("stuck_pendulum", Mishap::pendulum_sticks, "the pendulum encoder did not count", stuck),
      mishap("restart", Mishap::device_restarts, "restarted", at_once),
      mishap("device_hangs", Mishap::program_hangs, "restarted", stops({"rig_fault"}, processor_watchdog_s)),
      mishap("emergency_stop", Mishap::emergency_stop, "the emergency stop was pressed",
             stops({"emergency_stop"}, period_s)),
      mishap("limit_switch", Mishap::plus_switch, "the limit switch at the +x end was hit", at_the_track_end,
             "_plus"),
      mishap("limit_switch", Mishap::minus_switch, "the limit switch at the -x end was hit", at_the_track_end,
             "_minus"),
      mishap("edges_lost", Mishap::edges_too_fast, "encoder edges were lost", at_once),
  };
}

/// On the board's clock the link takes another way.
std::vector<Case> on_the_boards_clock(std::vector<Case> cases) {
  std::erase_if(cases, [](const Case& c) { return c.mishap == Mishap::cart_sticks || *c.more != '\0'; });
  for (Case& c : cases) {
    c.clock = LoopClock::board;
    c.more = "_on_the_boards_clock";
  }
  return cases;
}

std::vector<Case> all() {
  // The board's watchdog takes the voltage away while the controller stands still.
  const Expectation stood_still = stops({"overrun"}, watchdog_s + period_s);
  std::vector<Case> cases = line_cases();
  for (const Case& c : device_cases()) cases.push_back(c);
  for (const Case& c : on_the_boards_clock(cases)) cases.push_back(c);
  for (const std::vector<ProcessCase>& list : {sign_cases(), machine_cases(period_s, stood_still)})
    for (const ProcessCase& c : list) cases.push_back({.process = c});
  return cases;
}

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.process.fault << c.more;
}

/// The case with what befalls the board as something to do to the run.
ProcessCase process_of(const Case& c, BoardRig& board) {
  ProcessCase process = c.process;
  if (c.mishap != Mishap::none)
    process.action = [&board, what = c.mishap](const Running&) {
      board.suffer(what);
      return true;
    };
  if (c.cuts)
    process.action = [&board](const Running&) {
      board.cut();
      return true;
    };
  return process;
}

std::optional<Evidence> evidence_of(const Case& c, BoardSetting& setting) {
  const ProcessCase process = process_of(c, setting.board());
  const ProcessFiles files = setting.files(process.duration_s);
  const std::optional<double> done_s = run_with(process, files);
  if (!done_s || !std::filesystem::exists(files.runs)) return std::nullopt;
  sleep_s(watchdog_s + period_s);
  const std::vector<TraceRow> trace = setting.board().record();
  Evidence evidence;
  evidence.run = only_entry(files.runs);
  evidence.plant = plant_rows(trace);
  evidence.fault_s = begin_of(process, files, let_go_s(trace), *done_s, *done_s);
  evidence.log_may_end = process.begins == Begins::when_the_log_ends;
  return evidence;
}

class BoardFault : public testing::TestWithParam<Case> {};

TEST_P(BoardFault, HasItsOutcome) {
  const Case& c = GetParam();
  fault_case(c.process.fault, Bench::board, cell_of(c.process.expectation), [&] {
    BoardSetting setting(c.process, c.line, c.clock);
    const auto evidence = came_about(setting.runs(), [&] { return evidence_of(c, setting); });
    if (!evidence) return;
    ASSERT_NO_FATAL_FAILURE(judge(*evidence, c.process.expectation));
    EXPECT_TRUE(setting.board().at_rest());
    const std::string sentence = read_run(evidence->run).outcome->text("sentence");
    EXPECT_NE(sentence.find(c.cause), std::string::npos) << sentence;
  });
}

INSTANTIATE_TEST_SUITE_P(, BoardFault, testing::ValuesIn(all()), [](const auto& item) {
  return std::string(item.param.process.fault) + item.param.more;
});

TEST(BoardBroken, StopsWhenAValueIsNotANumber) {
  const Expectation expectation = stops({"not_finite"}, period_s);
  fault_case("nan", Bench::board, cell_of(expectation), [&] {
    BoardSetting setting;
    const auto evidence = came_about(setting.runs(), [&]() -> std::optional<Evidence> {
      const std::optional<BrokenRun> run =
          broken_run(setting.rig_file(), setting.gain_file(), setting.runs());
      if (!run) return std::nullopt;
      sleep_s(watchdog_s);
      return Evidence{plant_rows(setting.board().record()), run->began_s, run->directory, false, false};
    });
    if (!evidence) return;
    ASSERT_NO_FATAL_FAILURE(judge(*evidence, expectation));
    EXPECT_TRUE(setting.board().at_rest());
  });
}

struct Killed {
  double killed_s = 0.0, on_until_s = 0.0;
  bool was_on = false;  ///< a balancing loop commands exactly 0 V in about one period of a thousand
  std::size_t rows = 0;
};

bool is_on_at(double time_s, const std::vector<TraceRow>& trace) {
  bool is_on = false;
  for (const TraceRow& row : trace)
    if (row.time_s <= time_s) is_on = row.voltage_v != 0.0;
  return is_on;
}

std::optional<Killed> killed(BoardSetting& setting) {
  const std::optional<double> killed_s = kill_run(setting.files(60.0));
  if (!killed_s) return std::nullopt;
  sleep_s(2 * watchdog_s);
  const std::vector<TraceRow> trace = setting.board().record();
  return Killed{*killed_s, last_voltage_s(trace), is_on_at(*killed_s, trace),
                read_run(only_entry(setting.runs())).samples.rows.size()};
}

TEST(BoardKilled, ItsWatchdogTakesTheVoltageAway) {
  fault_case("sigkill", Bench::board, "device watchdog: 0 V within 100 ms", [] {
    BoardSetting setting;
    const auto run = came_about(setting.runs(), [&] { return killed(setting); });
    if (!run) return;
    const Interval before{run->killed_s - watchdog_s, run->killed_s};
    EXPECT_TIMING(before, run->on_until_s > run->killed_s - watchdog_s, "it was still balancing");
    EXPECT_TIMING(before, !run->was_on || run->on_until_s > run->killed_s, "the board kept the last voltage");
    EXPECT_TIMING((Interval{run->killed_s, run->on_until_s}),
                  run->on_until_s < run->killed_s + watchdog_s + period_s, "the watchdog is in time");
    EXPECT_GT(run->rows, 0u) << "the log reads";
  });
}

}  // namespace
}  // namespace upright::test
