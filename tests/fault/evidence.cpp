#include "evidence.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/run_end.hpp"
#include "upright/record/replay.hpp"
#include "upright/record/run_reader.hpp"

namespace upright::test {

namespace {

constexpr double busy_machine_s = 0.05;
constexpr double track_end_m = 0.407;

bool is_right(const std::string& reason, const Expectation& expectation) {
  const std::vector<std::string>& stops = expectation.reasons;
  return (expectation.is_within_bound && reason == "duration") ||
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

void judge_plant(const Evidence& evidence, const Expectation& expectation, const RunEnd& end) {
  ASSERT_FALSE(evidence.plant.empty());
  double farthest_m = 0.0;
  for (const PlantRow& row : evidence.plant) farthest_m = std::max(farthest_m, std::abs(row.cart_m));
  // Where the fault begins with the run, a stall can take its first voltage away too.
  EXPECT_TIMING(end.before(), last_voltage_s(evidence) > 0.0, "the motor was on");
  EXPECT_EQ(evidence.plant.back().voltage_v, 0.0) << "and is off in the end";
  EXPECT_LT(farthest_m, track_end_m);
  if (end.reason == "duration") return;
  const double on_until_s = last_voltage_s(evidence);
  EXPECT_TIMING((Interval{evidence.fault_s, on_until_s}), !is_late(evidence, expectation),
                end.reason + ": zero volts after " + std::to_string(on_until_s - evidence.fault_s) +
                    " s, not " + std::to_string(expectation.zero_within_s));
}

void judge_log(const Evidence& evidence, const RunRecord& run, const std::string& reason) {
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

void expect_came_about(bool came, const Since& begin, const std::filesystem::path& runs) {
  if (came) return;
  std::error_code none;
  const std::filesystem::path run = std::filesystem::exists(runs, none) ? only_entry(runs) : "";
  const std::optional<RunEnd> end = run.empty() ? std::nullopt : run_end(text_of(run / "run.yaml"));
  EXPECT_TIMING(end ? end->before() : begin.until_now(), came,
                "the run does not begin, or ends before its fault comes about");
}

void judge(const Evidence& evidence, const Expectation& expectation) {
  const RunRecord run = read_run(evidence.run);
  ASSERT_TRUE(run.outcome.has_value());
  const std::string reason = run.outcome->text("reason");
  const RunEnd end = run_end(text_of(evidence.run / "run.yaml")).value();
  EXPECT_END(end, is_right(reason, expectation));
  judge_plant(evidence, expectation, end);
  judge_log(evidence, run, reason);
}

void fault_case(const std::string& fault, Bench bench, const std::string& cell,
                const std::function<void()>& attempt) {
  if (!in_real_time(attempt))
    record_skipped(fault, bench);
  else if (!testing::Test::HasFailure())
    record(fault, bench, cell);
}

}  // namespace upright::test
