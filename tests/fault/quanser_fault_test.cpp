// The fault suite on a Quanser card: `upright run` with a libhil.so of the tests' own, whose card is a
// process of its own. The record is the card's own: what was on its output channel and its enable line, and
// what the plant made of it.
#include <gtest/gtest.h>

#include <fstream>
#include <memory>
#include <optional>
#include <utility>

#include "broken_run.hpp"
#include "evidence.hpp"
#include "fake_hil/card_process.hpp"
#include "process_case.hpp"
#include "upright/record/run_reader.hpp"

namespace upright::test {
namespace {

const std::string config = UPRIGHT_SOURCE_DIR "/config/";
constexpr double period_s = 0.005;
constexpr double watchdog_s = 0.1;
constexpr double after_s = 0.5;  // faults begin so long after the controller took over
const std::string after = "0.5";

using Changes = std::vector<std::pair<std::string, std::string>>;

struct Case {
  ProcessCase process;
  std::vector<std::string> mishap = {};  ///< flags of the fake card
  Changes rig = {};                      ///< in the rig file, of both sides
};

std::vector<Case> card_cases() {
  const Expectation by_the_watchdog =
      stops({"link_lost", "stale_encoder", "overrun", "rig_fault"}, watchdog_s + period_s);
  return {
      {{.fault = "late", .expectation = goes_on()}, {"--late-every", "20", "--late-s", "0.0045"}},
      {{.fault = "drop", .expectation = goes_on()}, {"--fail-every", "20"}},
      {{.fault = "always_late", .expectation = by_the_watchdog, .begins = Begins::at_the_start},
       {"--late-every", "1", "--late-s", "0.3"}},
      {{.fault = "cut", .expectation = stops({"link_lost", "rig_fault"}, watchdog_s + period_s)},
       {"--unplug-after", after}},
      {{.fault = "card_refuses", .expectation = stops({"rig_fault"}, 2 * period_s)},
       {"--refuse-after", after}},
      {{.fault = "card_expires", .expectation = stops({"rig_fault"}, 2 * period_s)},
       {"--expire-after", after}},
      {{.fault = "card_opens_late", .expectation = goes_on()}, {"--failed-openings", "2"}},
      {{.fault = "card_was_locked", .expectation = goes_on()}, {"--locked", "true"}},
  };
}

/// The card samples on its own time, and the loop follows it.
std::vector<Case> clock_cases() {
  const Changes clock = {{"  board_type: q2_usb\n", "  board_type: q2_usb\n  clock: card\n"}};
  return {
      {{.fault = "clock_drifts", .expectation = goes_on()}, {"--drift-ppm", "500"}, clock},
      {{.fault = "clock_samples_lost", .expectation = goes_on()}, {"--drop-every", "20"}, clock},
      {{.fault = "clock_stops", .expectation = stops({"link_lost"}, watchdog_s + period_s)},
       {"--stop-sampling-after", after},
       clock},
  };
}

std::vector<Case> encoder_cases() {
  const Expectation stuck = stops({"stuck_encoder"}, stuck_noticed_s);
  return {
      {{.fault = "stuck_cart", .expectation = stuck, .duration_s = 4.0},
       {"--stick", "cart", "--stick-after", after}},
      {{.fault = "stuck_pendulum", .expectation = stuck, .duration_s = 4.0},
       {"--stick", "pendulum", "--stick-after", after}},
      {{.fault = "jump", .expectation = stops({"rig_fault"}, 4 * period_s)},
       {"--jump-after", after, "--jump-counts", "5000"}},
      {{.fault = "wrap", .expectation = goes_on()},
       {},
       {{"cart_counts: 0, pendulum_counts: 0", "cart_counts: 32760, pendulum_counts: -32768"}}},
  };
}

std::vector<Case> all() {
  // The card's watchdog takes the voltage away while the controller stands still.
  const Expectation stood_still = stops({"overrun", "rig_fault"}, watchdog_s + period_s);
  std::vector<Case> list = card_cases();
  for (const std::vector<Case>& cases : {clock_cases(), encoder_cases()})
    for (const Case& c : cases) list.push_back(c);
  for (const std::vector<ProcessCase>& cases : {sign_cases(), machine_cases(period_s, stood_still)})
    for (const ProcessCase& c : cases) list.push_back({c});
  return list;
}

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.process.fault;
}

/// The card and its controller's files.
class Setting : public RunFolder {
 public:
  explicit Setting(const Case& c) {
    std::string wired = fake_card_rig();
    for (const auto& [from, to] : c.rig) wired = replaced(wired, from, to);
    card_ = std::make_unique<CardProcess>(folder(), wired, c.mishap);
    std::ofstream(rig_file()) << as_read(c.process, card_->rig_text());
    std::ofstream(gain_file()) << replaced(text_of(config + "gains/exponential.yaml"), "sample_rate_hz: 1000",
                                           "sample_rate_hz: 200");
  }
  CardProcess& card() { return *card_; }

 private:
  std::unique_ptr<CardProcess> card_;
};

/// What the plant was given, by the card's record of its own output: the plant's own record has where it was.
std::vector<PlantRow> rows_of(Setting& setting) {
  setting.card().end();
  return plant_rows(setting.card().trace());
}

/// The card's output is at zero in the end, its amplifier disabled or the card locked.
void expect_card_off(Setting& setting) {
  const std::vector<CardRow> record = setting.card().record();
  ASSERT_FALSE(record.empty());
  EXPECT_EQ(record.back().analog_v, 0.0);
  EXPECT_TRUE(!record.back().enabled || record.back().locked);
}

std::optional<Evidence> evidence_of(const Case& c, Setting& setting) {
  const ProcessFiles files = setting.files(c.process.duration_s);
  const std::optional<double> done_s = run_with(c.process, files);
  if (!done_s || !std::filesystem::exists(setting.runs())) return std::nullopt;
  sleep_s(watchdog_s);
  Evidence evidence;
  evidence.plant = rows_of(setting);
  const double first_s = let_go_s(setting.card().trace());
  evidence.run = only_entry(setting.runs());
  evidence.fault_s = begin_of(c.process, files, first_s, first_s + after_s, *done_s);
  evidence.log_may_end = c.process.begins == Begins::when_the_log_ends;
  return evidence;
}

class QuanserFault : public testing::TestWithParam<Case> {};

TEST_P(QuanserFault, HasItsOutcome) {
  const Case& c = GetParam();
  fault_case(c.process.fault, Bench::quanser_hil, cell_of(c.process.expectation), [&] {
    Setting setting(c);
    const auto evidence = came_about(setting.runs(), [&] { return evidence_of(c, setting); });
    if (!evidence) return;
    judge(*evidence, c.process.expectation);
    expect_card_off(setting);
  });
}

INSTANTIATE_TEST_SUITE_P(, QuanserFault, testing::ValuesIn(all()),
                         [](const auto& item) { return std::string(item.param.process.fault); });

struct Killed {
  double killed_s = 0.0, on_until_s = 0.0;
  std::size_t rows = 0;
};

std::optional<Killed> killed(Setting& setting) {
  const std::optional<double> killed_s = kill_run(setting.files(60.0));
  if (!killed_s) return std::nullopt;
  sleep_s(2 * watchdog_s);
  setting.card().end();
  return Killed{*killed_s, last_voltage_s(setting.card().trace()),
                read_run(only_entry(setting.runs())).samples.rows.size()};
}

TEST(QuanserKilled, IsAtZeroVoltsByTheCardsWatchdog) {
  fault_case("sigkill", Bench::quanser_hil, "device watchdog: 0 V within 100 ms", [] {
    Setting setting(Case{});
    const auto run = came_about(setting.runs(), [&] { return killed(setting); });
    if (!run) return;
    EXPECT_TIMING((Interval{run->killed_s - watchdog_s, run->killed_s}),
                  run->on_until_s > run->killed_s - watchdog_s, "it was still balancing");
    EXPECT_TIMING((Interval{run->killed_s, run->on_until_s}),
                  run->on_until_s < run->killed_s + watchdog_s + 0.05, "the watchdog is in time");
    EXPECT_GT(run->rows, 0u) << "the log reads";
    expect_card_off(setting);
  });
}

/// A run that is stopped while its card does not answer.
struct StoppedRun {
  double silent_s = 0.0, on_until_s = 0.0;
  int exit_code = 0;
  std::string zero_volts;
};

std::optional<StoppedRun> stopped_run(Setting& setting, bool for_good) {
  const ProcessFiles files = setting.files(60.0);
  Process controller(files.command);
  if (!wait_for_rows(files.runs)) return std::nullopt;
  sleep_s(0.3);
  StoppedRun run;
  run.silent_s = monotonic_s();
  kill(setting.card().id(), SIGUSR1);
  kill(controller.id(), SIGTERM);
  if (for_good) {
    sleep_s(2.0);
    kill(controller.id(), SIGINT);  // somebody gives up
  }
  controller.rest();
  run.exit_code = controller.wait();
  setting.card().end();
  run.on_until_s = last_voltage_s(setting.card().trace());
  const RunRecord left = read_run(only_entry(files.runs));
  if (!left.outcome) return std::nullopt;
  run.zero_volts = left.outcome->text("zero_volts");
  return run;
}

class QuanserStop : public testing::TestWithParam<bool> {};

TEST_P(QuanserStop, IsAtZeroVoltsByTheWatchdogOfASilentCard) {
  const bool for_good = GetParam();
  const char* cell = for_good ? "device watchdog: 0 V within 100 ms, reported as not confirmed, exit code 4"
                              : "device watchdog: 0 V within 100 ms, confirmed as soon as it responds";
  fault_case(for_good ? "stop_silent_watchdog" : "stop_refused_connections", Bench::quanser_hil, cell, [&] {
    Setting setting(Case{{}, {"--silent-s", for_good ? "60" : "1"}});
    const auto run = came_about(setting.runs(), [&] { return stopped_run(setting, for_good); });
    if (!run) return;
    EXPECT_GT(run->on_until_s, 0.0);
    EXPECT_TIMING((Interval{run->silent_s, run->on_until_s}),
                  run->on_until_s < run->silent_s + watchdog_s + 0.05, "the watchdog is in time");
    expect_card_off(setting);
    EXPECT_EQ(run->zero_volts, for_good ? "not_confirmed" : "confirmed");
    EXPECT_EQ(run->exit_code, for_good ? 4 : 3);
  });
}

INSTANTIATE_TEST_SUITE_P(, QuanserStop, testing::Bool(),
                         [](const auto& item) { return std::string(item.param ? "for_good" : "for_1_s"); });

TEST(QuanserBroken, StopsWhenAValueIsNotANumber) {
  const Expectation expectation = stops({"not_finite"}, period_s);
  fault_case("nan", Bench::quanser_hil, cell_of(expectation), [&] {
    Setting setting(Case{});
    const auto evidence = came_about(setting.runs(), [&]() -> std::optional<Evidence> {
      const ProcessFiles files = setting.files(0.0);
      const std::optional<BrokenRun> run = broken_run(files.rig_file, setting.gain_file(), files.runs);
      if (!run) return std::nullopt;
      sleep_s(watchdog_s);
      return Evidence{rows_of(setting), run->began_s, run->directory, false, false};
    });
    if (!evidence) return;
    judge(*evidence, expectation);
    expect_card_off(setting);
  });
}

}  // namespace
}  // namespace upright::test
