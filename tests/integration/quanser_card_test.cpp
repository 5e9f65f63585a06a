// The Quanser backend on a library and a card of the tests' own: opening, refusals, the watchdog's lock, the
// doctor's proof, and what a run records of the card.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "../fault/fake_hil/card_process.hpp"
#include "hal/quanser_proof.hpp"
#include "tests/support/run_end.hpp"
#include "upright/base/error.hpp"
#include "upright/hal/clock.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/record/run_reader.hpp"

namespace upright::test {
namespace {

constexpr double period_s = 0.05;
/// Of the card: what is tested here is what it does, not how fast.
constexpr double watchdog_s = 1.0;

void sleep_s(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

/// The card, and a rig on it.
struct Bench {
  explicit Bench(const std::string& wired = fake_card_rig(), const std::vector<std::string>& flags = {})
      : card(folder, replaced(wired, "  watchdog_s: 0.1", "  watchdog_s: 1.0"), flags),
        file(read_rig(YamlMap::from_text(card.rig_text(), "rig.yaml"))),
        rig(make_rig(file, {period_s})) {}

  CardRow last() const { return card.record().back(); }

  Folder folder;
  CardProcess card;
  RigFile file;
  std::unique_ptr<Rig> rig;
};

std::string refusal_of(Rig& rig) {
  try {
    rig.open();
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "";
}

/// A whole run on a card: its run.yaml, and what it printed with --json.
struct CardRun {
  std::string text;
  nlohmann::json document;
  int exit_code;
};

constexpr const char* shipped_filter = "{kind: second_order_filter, cutoff_hz: 50, damping: 0.9}";

void write_files_for_200_hz(const Folder& folder, const CardProcess& card, const char* velocity_estimator) {
  std::ofstream(folder / "rig.yaml") << card.rig_text();
  std::ofstream(folder / "gains.yaml")
      << replaced(replaced(text_of(UPRIGHT_SOURCE_DIR "/config/gains/exponential.yaml"),
                           "sample_rate_hz: 1000", "sample_rate_hz: 200"),
                  shipped_filter, velocity_estimator);
}

CardRun run_at_200_hz(Folder& folder, const CardProcess& card, const char* duration_s,
                      const char* velocity_estimator = shipped_filter) {
  write_files_for_200_hz(folder, card, velocity_estimator);
  Process run({UPRIGHT_BINARY, "run", "--rig", folder / "rig.yaml", "--gains", folder / "gains.yaml",
               "--duration", duration_s, "--out", folder / "runs", "--json", "--unchecked"});
  nlohmann::json document = nlohmann::json::parse(run.rest());
  const int exit_code = run.wait();
  return {text_of(only_entry(folder / "runs") / "run.yaml"), std::move(document), exit_code};
}

TEST(QuanserCard, OpensAtZeroVoltsAndReadsItsCounts) {
  Bench bench;
  bench.rig->open();
  EXPECT_EQ(bench.last().analog_v, 0.0);
  EXPECT_FALSE(bench.last().enabled);
  const RigReading reading = bench.rig->read();
  EXPECT_EQ(reading.status, RigStatus::fresh);
  EXPECT_EQ(reading.cart_counts, 0);
  EXPECT_EQ(reading.pendulum_counts, 34) << "3 degrees of 4096 counts per turn";
}

TEST(QuanserCard, PutsOutTheVoltageThroughTheAmplifiersGainAndSign) {
  Bench bench(replaced(replaced(fake_card_rig(), "amplifier_gain: 1", "amplifier_gain: 3"),
                       "limit_v: 10.0, sign: 1", "limit_v: 10.0, sign: -1"));
  bench.rig->open();
  EXPECT_EQ(bench.rig->write(6.0), RigFault::none);
  EXPECT_DOUBLE_EQ(bench.last().analog_v, -2.0);
  EXPECT_TRUE(bench.last().enabled);
  EXPECT_EQ(bench.rig->write(std::nan("")), RigFault::not_finite);
  EXPECT_EQ(bench.last().analog_v, 0.0);
  EXPECT_TRUE(bench.rig->stop().done());
  EXPECT_FALSE(bench.last().enabled);
  EXPECT_EQ(bench.rig->write(6.0), RigFault::none) << "a stop is latched";
  EXPECT_EQ(bench.last().analog_v, 0.0);
}

TEST(QuanserCard, AnExpiredWatchdogGivesZeroVoltsAndLocksTheCard) {
  Bench bench;
  bench.rig->open();
  ASSERT_EQ(bench.rig->write(2.0), RigFault::none);
  sleep_s(1.5 * watchdog_s);
  EXPECT_TRUE(bench.last().locked);
  EXPECT_EQ(bench.last().analog_v, 0.0);
  EXPECT_EQ(bench.rig->read().fault, RigFault::watchdog_expired);
  EXPECT_EQ(bench.rig->write(2.0), RigFault::watchdog_expired);
  EXPECT_EQ(bench.last().analog_v, 0.0);
  EXPECT_TRUE(bench.rig->stop().done());
  EXPECT_TRUE(bench.rig->stop().done()) << "the loop stops it once more at its end";
  bench.rig->open();
  EXPECT_FALSE(bench.last().locked);
  EXPECT_EQ(bench.rig->write(2.0), RigFault::none);
  EXPECT_EQ(bench.last().analog_v, 2.0);
}

TEST(QuanserCard, ASecondControllerIsRefused) {
  Bench bench;
  bench.rig->open();
  const auto second = make_rig(bench.file, {period_s});
  EXPECT_NE(refusal_of(*second).find("already has a controller"), std::string::npos);
}

TEST(QuanserCard, OpeningIsTriedThreeTimesAndThenRefused) {
  Bench bench(fake_card_rig(), {"--failed-openings", "3"});
  const std::string sentence = refusal_of(*bench.rig);
  EXPECT_NE(sentence.find("error 108: board not found"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("plug the card in"), std::string::npos) << sentence;
  EXPECT_EQ(refusal_of(*bench.rig), "") << "the fourth attempt succeeds";
}

TEST(QuanserCard, ALibraryThatIsAnotherIsRefused) {
  RigFile file = read_rig(YamlMap::from_text(fake_card_rig(), "rig.yaml"));
  file.quanser->library = "libm.so.6";
  const std::string sentence = refusal_of(*make_rig(file, {period_s}));
  EXPECT_NE(sentence.find("is not a HIL library"), std::string::npos) << sentence;
}

TEST(QuanserCard, AWatchdogShorterThanTwoPeriodsIsRefused) {
  const RigFile file = read_rig(YamlMap::from_text(fake_card_rig(), "rig.yaml"));
  EXPECT_THROW(require_link_fits(file, 0.06), ConfigError);
  EXPECT_NO_THROW(require_link_fits(file, 0.05));
}

TEST(QuanserCard, CountersBeginAtZeroWhereTheZeroIsTakenAtTheStart) {
  Bench bench(replaced(fake_card_rig(), "{at: counts, cart_counts: 0, pendulum_counts: 0, pose: upright}",
                       "{at: start, pose: upright}"));
  bench.rig->open();
  EXPECT_EQ(bench.rig->read().pendulum_counts, 0);
}

TEST(QuanserCard, IsProvedStepByStep) {
  Bench bench(fake_card_rig(), {"--locked", "true"});
  std::vector<std::string> passed;
  for (const CardStep& step : prove_quanser_card(bench.file)) {
    EXPECT_TRUE(step.passed) << step.subject << ": " << step.remedy;
    passed.push_back(step.subject);
  }
  EXPECT_EQ(passed, (std::vector<std::string>{"Quanser library", "Quanser card", "Quanser card's output",
                                              "Quanser card's encoders", "Quanser card's watchdog"}));
  EXPECT_FALSE(bench.last().locked);
  for (const CardRow& row : bench.card.record()) EXPECT_EQ(row.analog_v, 0.0);
}

/// The same, where the card's velocities are read.
std::string with_velocities(const std::string& rig_text) {
  return rig_text + "  encoder_velocities: true\n";
}

TEST(QuanserCard, ReadsVelocitiesOnlyWhereTheFileAsksForThem) {
  Bench plain;
  plain.rig->open();
  EXPECT_FALSE(plain.rig->measures_velocities());
  EXPECT_TRUE(std::isnan(plain.rig->read().cart_counts_per_s));
  Bench bench(with_velocities(fake_card_rig()));
  bench.rig->open();
  EXPECT_TRUE(bench.rig->measures_velocities());
  EXPECT_EQ(bench.rig->read().cart_counts_per_s, 0.0);
  ASSERT_EQ(bench.rig->write(4.0), RigFault::none);
  sleep_s(0.03);
  const RigReading moving = bench.rig->read();
  EXPECT_GT(moving.cart_counts_per_s, 100.0);
  EXPECT_GT(moving.cart_counts, 0);
}

TEST(QuanserCard, ACardWithoutVelocitiesIsRefused) {
  Bench bench(with_velocities(fake_card_rig()), {"--lacks-velocities", "true"});
  const std::string sentence = refusal_of(*bench.rig);
  EXPECT_NE(sentence.find("reading the velocities of the encoders"), std::string::npos) << sentence;
}

TEST(QuanserCard, ARunOnMeasuredVelocitiesReplays) {
  in_real_time([] {
    Folder folder;
    const CardProcess card(folder, with_velocities(fake_card_rig()));
    const CardRun run = run_at_200_hz(folder, card, "1", "{kind: device}");
    EXPECT_END(run_end(run.text).value(), run.exit_code == 0);
    Process replay({UPRIGHT_BINARY, "replay", only_entry(folder / "runs")});
    replay.rest();
    EXPECT_EQ(replay.wait(), 0);
  });
}

TEST(QuanserCard, ARigWithoutVelocitiesCannotRunOnThem) {
  Folder folder;
  const CardProcess card(folder, fake_card_rig());
  write_files_for_200_hz(folder, card, "{kind: device}");
  Process run({UPRIGHT_BINARY, "run", "--rig", folder / "rig.yaml", "--gains", folder / "gains.yaml",
               "--duration", "1", "--out", folder / "runs", "--unchecked"});
  run.rest();
  EXPECT_EQ(run.wait(), 2);
}

TEST(QuanserCard, SamplesOnItsOwnClockAreReadOnceEach) {
  Bench bench(on_the_cards_clock(fake_card_rig()));
  EXPECT_FALSE(bench.rig->is_clock()) << "not open yet";
  bench.rig->open();
  EXPECT_TRUE(bench.rig->is_clock());
  constexpr std::int64_t long_ns = 2'000'000'000;
  const DeviceSample first = bench.rig->wait_next(MonotonicClock().now_ns() + long_ns);
  EXPECT_GT(first.number, 0u);
  const RigReading reading = bench.rig->read();
  EXPECT_EQ(reading.status, RigStatus::fresh);
  EXPECT_EQ(reading.pendulum_counts, 34) << "3 degrees of 4096 counts per turn";
  EXPECT_GE(reading.time_ns, first.time_ns);
  const DeviceSample second = bench.rig->wait_next(MonotonicClock().now_ns() + long_ns);
  EXPECT_GT(second.number, first.number);
  EXPECT_EQ(bench.rig->wait_next(0).number, second.number) << "it does not wait longer than it may";
}

TEST(QuanserCard, IsOpenedAgainOnItsOwnClock) {
  Bench bench(on_the_cards_clock(fake_card_rig()));
  bench.rig->open();
  ASSERT_EQ(bench.rig->write(2.0), RigFault::none);
  sleep_s(1.5 * watchdog_s);
  EXPECT_TRUE(bench.last().locked);
  EXPECT_EQ(bench.rig->read().fault, RigFault::watchdog_expired);
  bench.rig->open();
  bench.rig->wait_next(MonotonicClock().now_ns() + 2'000'000'000);
  EXPECT_EQ(bench.rig->read().status, RigStatus::fresh);
}

TEST(QuanserCard, AClockThatMakesAnotherRateIsRefused) {
  Bench bench(on_the_cards_clock(fake_card_rig()), {"--drift-ppm", "100000"});
  const std::string sentence = refusal_of(*bench.rig);
  EXPECT_NE(sentence.find("and not every 0.05 s: give sample_rate_hz"), std::string::npos) << sentence;
}

TEST(QuanserCard, AClockThatStandsStillIsRefused) {
  Bench bench(on_the_cards_clock(fake_card_rig()), {"--never-samples", "true"});
  const std::string sentence = refusal_of(*bench.rig);
  EXPECT_NE(sentence.find("takes no samples on its own clock: remove quanser_hil.clock"), std::string::npos)
      << sentence;
}

TEST(QuanserCard, ARunFollowsTheCardsClockAndReportsDriftAndLoss) {
  in_real_time([] {
    Folder folder;
    const CardProcess card(folder, on_the_cards_clock(fake_card_rig()),
                           {"--drift-ppm", "2000", "--drop-every", "20"});
    const CardRun run = run_at_200_hz(folder, card, "2");
    const RunEnd end = run_end(run.text).value();
    EXPECT_END(end, run.exit_code == 0);
    const nlohmann::json& clock = run.document.at("device_clock");
    // A sample that comes half a millisecond late at either end is 250 ppm of 2 s.
    EXPECT_TIMING(end.before(), std::abs(clock.at("drift_ppm").get<double>() - 2000.0) < 500.0,
                  "drift " + clock.dump());
    EXPECT_TIMING(end.before(), std::abs(clock.at("lost").get<double>() - 20.0) <= 3.0,
                  "loss " + clock.dump());
    EXPECT_NE(run.document.at("scheduling").get<std::string>().find("on the clock of the rig's device"),
              std::string::npos);
  });
}

TEST(QuanserCard, ARunRecordsWhichCardAndLibraryItWas) {
  in_real_time([] {
    Folder folder;
    const CardProcess card(folder, fake_card_rig());
    const CardRun run = run_at_200_hz(folder, card, "0.5");
    EXPECT_END(run_end(run.text).value(), run.exit_code == 0);
    for (const char* fact : {"serial_number: '12345'", "library_version: '9.8.7'", "product: 'Fake Q2-USB'"})
      EXPECT_NE(run.text.find(fact), std::string::npos) << fact;
    EXPECT_TRUE(read_run(only_entry(folder / "runs")).outcome.has_value());
  });
}

}  // namespace
}  // namespace upright::test
