#include "evidence.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "upright/record/replay.hpp"
#include "upright/record/run_reader.hpp"

namespace upright::test {

namespace {

constexpr double busy_machine_s = 0.05;
constexpr double track_end_m = 0.407;

bool is_right(const std::string& reason, const Expectation& expectation) {
  const std::vector<std::string>& stops = expectation.reasons;
  return (expectation.may_go_on && reason == "duration") ||
         std::find(stops.begin(), stops.end(), reason) != stops.end();
}

double last_voltage_s(const Evidence& evidence) {
  double on_until_s = -1.0;
  for (const PlantRow& row : evidence.plant)
    if (row.voltage_v != 0.0) on_until_s = row.time_s;
  return on_until_s;
}

bool is_late(const Evidence& evidence, const Expectation& expectation) {
  return last_voltage_s(evidence) - evidence.fault_s >= expectation.zero_within_s + busy_machine_s;
}

/// The reason in run.yaml.
std::string reason_of(const Evidence& evidence) {
  const RunRecord run = read_run(evidence.run);
  return run.outcome ? run.outcome->text("reason") : "";
}

bool machine_was_too_busy(const Evidence& evidence, const Expectation& expectation) {
  const std::string reason = reason_of(evidence);
  if (is_right(reason, expectation)) return reason != "duration" && is_late(evidence, expectation);
  return reason == "overrun" || reason == "stale_encoder" || reason == "link_lost";
}

void judge_plant(const Evidence& evidence, const Expectation& expectation, const std::string& reason) {
  ASSERT_FALSE(evidence.plant.empty());
  double farthest_m = 0.0;
  for (const PlantRow& row : evidence.plant) farthest_m = std::max(farthest_m, std::abs(row.cart_m));
  EXPECT_GT(last_voltage_s(evidence), 0.0) << "the motor was on";
  EXPECT_EQ(evidence.plant.back().voltage_v, 0.0) << "and is off in the end";
  EXPECT_LT(farthest_m, track_end_m);
  if (reason == "duration") return;
  EXPECT_FALSE(is_late(evidence, expectation))
      << reason << ": zero volts after " << last_voltage_s(evidence) - evidence.fault_s << " s, not "
      << expectation.zero_within_s;
}

void judge_log(const Evidence& evidence, const std::string& reason) {
  const RunRecord run = read_run(evidence.run);
  ASSERT_TRUE(run.outcome.has_value());
  EXPECT_FALSE(run.samples.truncated);
  const std::vector<LogRecord>& rows = run.samples.rows;
  ASSERT_FALSE(rows.empty());
  const std::string sentence = run.outcome->text("sentence");
  EXPECT_FALSE(sentence.empty());
  if (!evidence.log_may_end) {
    const auto missed =
        static_cast<std::uint64_t>(run.outcome->map("counts").integer("missed", 0, 1'000'000));
    EXPECT_EQ(rows.size() + missed, rows.back().tick + 1) << "every row is there";
    EXPECT_EQ((rows.back().flags & row_flag::stopped) != 0, reason != "duration");
  }
  if (evidence.replays) {
    EXPECT_FALSE(replay(run).first_mismatch.has_value());
  }
}

}  // namespace

std::vector<PlantRow> plant_rows(const std::vector<TraceRow>& trace) {
  std::vector<PlantRow> rows;
  rows.reserve(trace.size());
  for (const TraceRow& row : trace) rows.push_back({row.time_s, row.voltage_v, row.cart_m});
  return rows;
}

double log_end_s(const std::filesystem::path& run) {
  const RunRecord record = read_run(run);
  return record.outcome->number("started_monotonic_s", Range{}) +
         1e-9 * static_cast<double>(record.samples.rows.back().time_ns);
}

void judge(const Evidence& evidence, const Expectation& expectation) {
  const std::string reason = reason_of(evidence);
  EXPECT_TRUE(is_right(reason, expectation)) << "it ended with: " << reason;
  judge_plant(evidence, expectation, reason);
  judge_log(evidence, reason);
}

void judge_attempts(const std::function<std::optional<Evidence>()>& attempt, const Expectation& expectation) {
  const std::optional<Evidence> evidence =
      tried(attempt, [&](const Evidence& left) { return !machine_was_too_busy(left, expectation); });
  ASSERT_TRUE(evidence.has_value()) << never_came_about;
  judge(*evidence, expectation);
}

}  // namespace upright::test
