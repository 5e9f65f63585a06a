// The fault suite on lines and cards: `upright run` drives a plant behind the kernel's simulated devices,
// which is what judges it.
#include <gtest/gtest.h>
#include <signal.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "../fault/broken_run.hpp"
#include "../fault/evidence.hpp"
#include "../fault/process_case.hpp"
#include "card_wires.hpp"
#include "guest_run.hpp"
#include "line_wires.hpp"
#include "plant_on_wires.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/record/run_reader.hpp"

namespace upright::test {
namespace {

constexpr double period_s = 1.0 / GuestRun::rate_hz;
constexpr double watchdog_s = 0.1;
constexpr double heart_s = 1e-9 * static_cast<double>(ExternalWatchdog::patience_ns);

struct Case {
  ProcessCase process;
  Mishap mishap = Mishap::none;
  const char* cause = "";  ///< a part of the run's sentence
  const char* more = "";   ///< of the test's name, where a fault has several
  CardWires::Encoders encoders = CardWires::Encoders::potentiometers;
  int sample_rate_hz = GuestRun::rate_hz;
};

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

/// What can befall either rig. `stood_still` is what comes of a controller that stands still for 250 ms.
std::vector<Case> common_cases(const Expectation& stood_still) {
  std::vector<Case> cases = {
      mishap("stuck_cart", Mishap::cart_sticks, "the cart encoder did not count",
             stops({"stuck_encoder"}, stuck_noticed_s)),
      mishap("stuck_pendulum", Mishap::pendulum_sticks, "the pendulum encoder did not count",
             stops({"stuck_encoder"}, stuck_noticed_s)),
      mishap("jump", Mishap::cart_jumps, "the encoder counts jumped", stops({"rig_fault"}, 4 * period_s)),
  };
  for (const ProcessCase& c : sign_cases())
    cases.push_back({.process = c, .cause = "check the signs of the encoders and the amplifier"});
  for (const ProcessCase& c : machine_cases(period_s, stood_still)) cases.push_back({.process = c});
  return cases;
}

std::vector<Case> line_cases() {
  std::vector<Case> cases = common_cases(stops({"overrun"}, heart_s + period_s));
  const Expectation at_the_track_end = stops({"track_limit"}, period_s);
  const Expectation at_once = stops({"rig_fault"}, period_s);
  for (const Case& c : {mishap("emergency_stop", Mishap::emergency_stop, "the emergency stop was pressed",
                               stops({"emergency_stop"}, period_s)),
                        mishap("limit_switch", Mishap::plus_switch, "the limit switch at the +x end was hit",
                               at_the_track_end, "_plus"),
                        mishap("limit_switch", Mishap::minus_switch, "the limit switch at the -x end was hit",
                               at_the_track_end, "_minus"),
                        mishap("line_failed", Mishap::encoders_go, "a digital line", at_once),
                        mishap("edges_too_fast", Mishap::encoder_rattles,
                               "edges came faster than fastest_edges_per_s", at_once)})
    cases.push_back(c);
  // While the edges are made, for some 35 ms on an emulated processor, the controller stands still: that must
  // be less than the three periods after which it stops for being late.
  cases.push_back(mishap("edges_lost", Mishap::edges_burst, "encoder edges were lost", at_once));
  cases.back().sample_rate_hz = 50;
  return cases;
}

std::vector<Case> card_cases() {
  // Nothing takes a card's voltage away while the program stands still.
  std::vector<Case> cases = common_cases(stops({"overrun"}, 0.25 + 2 * period_s));
  const Expectation lost = stops({"link_lost"}, watchdog_s + period_s);
  cases.push_back(mishap("no_contact", Mishap::cart_has_no_contact,
                         "an encoder reading was outside its valid range", lost));
  cases.push_back(mishap("cut", Mishap::encoders_go, "check the cable, the address and the device", lost));
  cases.push_back(
      {.process = {.fault = "wrap", .expectation = goes_on()}, .encoders = CardWires::Encoders::counters});
  return cases;
}

struct On {
  Bench bench;
  Case what;
};

std::string name_of(Bench bench) {
  return bench == Bench::gpio ? "gpio" : "comedi";
}

void PrintTo(const On& on, std::ostream* out) {
  *out << on.what.process.fault << " on " << name_of(on.bench);
}

/// A rig's devices, the plant behind them, and the files of a run.
class Setting {
 public:
  explicit Setting(const On& on)
      : rig_text_(text_for(on)),
        files_(as_read(on.what.process, rig_text_), on.what.sample_rate_hz),
        wires_(wires_for(on)),
        plant_(*wires_, rig_text_, on.bench == Bench::gpio ? line_rig_start : card_rig_start,
               files_.trace()) {}

  const GuestRun& files() const { return files_; }
  Wires& wires() { return *wires_; }
  PlantOnWires& plant() { return plant_; }

 private:
  static std::string text_for(const On& on) {
    if (on.bench == Bench::gpio) return line_rig_text;
    return on.what.encoders == CardWires::Encoders::counters ? counter_rig_text() : card_rig_text();
  }
  static std::unique_ptr<Wires> wires_for(const On& on) {
    if (on.bench == Bench::gpio) return std::make_unique<LineWires>();
    return std::make_unique<CardWires>(on.what.encoders);
  }

  std::string rig_text_;
  GuestRun files_;
  std::unique_ptr<Wires> wires_;
  PlantOnWires plant_;
};

/// The case with its mishap as something to do to the run. Edges are lost while nobody can take them.
ProcessCase process_of(const Case& c, PlantOnWires& plant) {
  ProcessCase process = c.process;
  if (c.mishap == Mishap::edges_burst)
    process.action = [&plant](const Running& run) {
      kill(run.controller, SIGSTOP);
      plant.suffer(Mishap::edges_burst);
      return kill(run.controller, SIGCONT) == 0;
    };
  else if (c.mishap != Mishap::none)
    process.action = [&plant, what = c.mishap](const Running&) {
      plant.suffer(what);
      return true;
    };
  return process;
}

std::optional<Evidence> evidence_of(const Case& c, Setting& setting) {
  const ProcessCase process = process_of(c, setting.plant());
  const ProcessFiles files = setting.files().files(process.duration_s);
  const std::optional<double> done_s = run_with(process, files);
  if (!done_s) return std::nullopt;
  sleep_s(watchdog_s);
  const std::vector<TraceRow> trace = setting.plant().record();
  Evidence evidence;
  evidence.run = only_entry(files.runs);
  evidence.plant = plant_rows(trace);
  evidence.fault_s = begin_of(process, files, let_go_s(trace), *done_s, *done_s);
  evidence.log_may_end = process.begins == Begins::when_the_log_ends;
  return evidence;
}

class KernelFault : public testing::TestWithParam<On> {};

TEST_P(KernelFault, HasItsOutcome) {
  const On& on = GetParam();
  const Expectation& expectation = on.what.process.expectation;
  fault_case(on.what.process.fault, on.bench, cell_of(expectation), [&] {
    Setting setting(on);
    const auto evidence = came_about(setting.files().runs(), [&] { return evidence_of(on.what, setting); });
    if (!evidence) return;
    ASSERT_NO_FATAL_FAILURE(judge(*evidence, expectation));
    EXPECT_TRUE(setting.wires().at_rest());
    const std::string sentence = read_run(evidence->run).outcome->text("sentence");
    EXPECT_NE(sentence.find(on.what.cause), std::string::npos) << sentence;
  });
}

std::vector<On> on_bench(Bench bench, const std::vector<Case>& cases) {
  std::vector<On> list;
  list.reserve(cases.size());
  for (const Case& c : cases) list.push_back({bench, c});
  return list;
}

std::string fault_name(const testing::TestParamInfo<On>& item) {
  return std::string(item.param.what.process.fault) + item.param.what.more;
}

INSTANTIATE_TEST_SUITE_P(Gpio, KernelFault, testing::ValuesIn(on_bench(Bench::gpio, line_cases())),
                         fault_name);
INSTANTIATE_TEST_SUITE_P(Comedi, KernelFault, testing::ValuesIn(on_bench(Bench::comedi, card_cases())),
                         fault_name);

class KernelBroken : public testing::TestWithParam<Bench> {};

std::optional<Evidence> evidence_of_a_broken_controller(Setting& setting) {
  const GuestRun& files = setting.files();
  const std::optional<BrokenRun> run = broken_run(files.rig_file(), files.gain_file(), files.runs());
  if (!run) return std::nullopt;
  sleep_s(watchdog_s);
  return Evidence{plant_rows(setting.plant().record()), run->began_s, run->directory, false, false};
}

TEST_P(KernelBroken, StopsWhenAValueIsNotANumber) {
  const Expectation expectation = stops({"not_finite"}, period_s);
  fault_case("nan", GetParam(), cell_of(expectation), [&] {
    Setting setting(On{GetParam(), {}});
    const auto evidence =
        came_about(setting.files().runs(), [&] { return evidence_of_a_broken_controller(setting); });
    if (!evidence) return;
    ASSERT_NO_FATAL_FAILURE(judge(*evidence, expectation));
    EXPECT_TRUE(setting.wires().at_rest());
  });
}

INSTANTIATE_TEST_SUITE_P(, KernelBroken, testing::Values(Bench::gpio, Bench::comedi),
                         [](const auto& item) { return name_of(item.param); });

TEST(KernelKilled, TheHeartStopsAndItsWatchdogTakesTheVoltageAway) {
  Setting setting({Bench::gpio, {}});
  const std::optional<double> killed_s = kill_run(setting.files().files(60.0));
  ASSERT_TRUE(killed_s.has_value()) << "the run does not begin, or ends before it is killed";
  sleep_s(3 * heart_s);
  const double on_until_s = last_voltage_s(setting.plant().record());
  EXPECT_GT(on_until_s, *killed_s - period_s) << "it was still balancing";
  EXPECT_LT(on_until_s, *killed_s + heart_s + period_s);
  EXPECT_FALSE(read_run(only_entry(setting.files().runs())).samples.rows.empty()) << "the log reads";
  if (!HasFailure()) record("sigkill", Bench::gpio, "heartbeat watchdog: 0 V within 100 ms");
}

/// What the documentation says: a card has no watchdog of its own.
TEST(KernelKilled, ACardKeepsItsVoltageUntilTheNextStart) {
  Setting setting({Bench::comedi, {}});
  ASSERT_TRUE(kill_run(setting.files().files(60.0)).has_value()) << "the run does not begin";
  EXPECT_FALSE(setting.wires().at_rest());
  sleep_s(3 * watchdog_s);
  EXPECT_FALSE(setting.wires().at_rest());
  const auto rig = make_rig(read_rig_file(setting.files().rig_file()), {period_s});
  rig->open();
  EXPECT_TRUE(setting.wires().at_rest()) << "the lock went with the process, and opening puts out zero volts";
  if (!HasFailure()) record("sigkill", Bench::comedi, "the last voltage remains until the next start");
}

}  // namespace
}  // namespace upright::test
