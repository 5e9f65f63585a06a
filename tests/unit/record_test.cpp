#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <set>
#include <string>

#include "record/run_log.hpp"
#include "temporary_folder.hpp"
#include "upright/base/error.hpp"
#include "upright/record/link_counts.hpp"
#include "upright/record/run_directory.hpp"
#include "upright/record/run_reader.hpp"
#include "upright/record/timing_stats.hpp"

namespace upright {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;
using test::text_of;

TEST(DurationHistogram, BoundsQuantilesByAnEighthOfAnOctave) {
  DurationHistogram histogram;
  for (int i = 1; i <= 100000; ++i) histogram.add(i);
  for (const double part : {0.001, 0.5, 0.99, 0.999}) {
    const double exact_us = part * 100.0;
    EXPECT_GE(histogram.quantile_us(part), exact_us * 0.999);
    EXPECT_LE(histogram.quantile_us(part), exact_us * 1.13);
  }
  EXPECT_EQ(histogram.max_us(), 100.0);
  EXPECT_EQ(histogram.quantile_us(1.0), 100.0);
  histogram.add(std::numeric_limits<std::int64_t>::max());
  histogram.add(-5);
  EXPECT_EQ(histogram.count(), 100002u);
}

TEST(RunLog, RowsReadBackToTheSameBits) {
  TemporaryFolder folder;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> any(-1e3, 1e3);
  std::uniform_int_distribution<std::int64_t> whole(-1'000'000'000'000, 1'000'000'000'000);
  std::vector<LogRecord> rows;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    LogRecord r;
    r.tick = i;
    r.time_ns = std::abs(whole(random));
    r.cart_counts = whole(random);
    r.pendulum_counts = whole(random);
    r.cart_m = any(random) * 1e-9;
    r.theta_rad = any(random);
    r.cart_velocity_mps = i % 2 == 0 ? 0.0 : -0.0;
    r.pendulum_rate_radps = any(random) * 1e12;
    r.voltage_requested_v = i % 7 == 0 ? std::numeric_limits<double>::infinity() : any(random);
    r.voltage_v = any(random);
    r.wake_late_ns = std::abs(whole(random)) / 1000;
    r.flags = static_cast<std::uint32_t>(i);
    r.sequence = i * 3;
    rows.push_back(r);
  }
  {
    RunLog log(folder.path() / "samples.csv", {});
    for (const LogRecord& r : rows) log.push_waiting(r);
    log.close();
    EXPECT_EQ(log.rows_written(), rows.size());
    EXPECT_FALSE(log.failed());
  }
  const Samples samples = read_samples(folder.path() / "samples.csv");
  EXPECT_FALSE(samples.truncated);
  ASSERT_EQ(samples.rows.size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(samples.rows[i].time_ns, rows[i].time_ns);
    EXPECT_EQ(samples.rows[i].cart_counts, rows[i].cart_counts);
    EXPECT_EQ(samples.rows[i].cart_m, rows[i].cart_m);
    EXPECT_EQ(samples.rows[i].pendulum_rate_radps, rows[i].pendulum_rate_radps);
    EXPECT_EQ(std::signbit(samples.rows[i].cart_velocity_mps), std::signbit(rows[i].cart_velocity_mps));
    EXPECT_EQ(samples.rows[i].voltage_requested_v, rows[i].voltage_requested_v);
    EXPECT_EQ(samples.rows[i].wake_late_ns, rows[i].wake_late_ns);
    EXPECT_EQ(samples.rows[i].flags, rows[i].flags);
    EXPECT_EQ(samples.rows[i].sequence, rows[i].sequence);
  }
}

TEST(RunLog, CountsWhatTheQueueCouldNotHold) {
  TemporaryFolder folder;
  RunLog::Options options;
  options.queue_rows = 4;
  RunLog log(folder.path() / "samples.csv", options);
  std::uint64_t pushed = 0;
  for (int i = 0; i < 5000; ++i)
    if (log.push({})) ++pushed;
  log.close();
  EXPECT_EQ(pushed + log.rows_dropped(), 5000u);
  EXPECT_GT(log.rows_dropped(), 0u);
  EXPECT_EQ(log.rows_written(), pushed);
  EXPECT_TRUE(log.failed());
  EXPECT_NE(log.failure().find(std::to_string(log.rows_dropped()) + " rows were lost"), std::string::npos)
      << log.failure();
}

TEST(ReadSamples, LeavesOutWhatAPowerCutLeaves) {
  TemporaryFolder folder;
  const fs::path file = folder.path() / "samples.csv";
  const std::string header = std::string(sample_columns) + "\n";
  const std::string row = "0,0,1,2,0,0,0,0,1.5,1.5,0,0,0,0,0,1\n";
  const auto write = [&](const std::string& text) { std::ofstream(file, std::ios::binary) << text; };
  for (std::size_t cut = 1; cut < row.size(); ++cut) {
    write(header + row + row.substr(0, cut));
    const Samples samples = read_samples(file);
    EXPECT_EQ(samples.rows.size(), 1u) << cut;
    EXPECT_TRUE(samples.truncated) << cut;
  }
  write(header + row + std::string(500, '\0'));
  EXPECT_EQ(read_samples(file).rows.size(), 1u);
  write(header.substr(0, 20));
  EXPECT_TRUE(read_samples(file).truncated);
  write(header + row + "0,0,what\n" + row);
  EXPECT_THROW(read_samples(file), ConfigError);
  write("tick,time_s\n0,0\n");
  EXPECT_THROW(read_samples(file), ConfigError);
}

/// More than fits into the reader's buffer at once.
TEST(SampleReader, ReadsALongFileRowByRow) {
  TemporaryFolder folder;
  const fs::path file = folder.path() / "samples.csv";
  constexpr std::uint64_t count = 60'000;
  std::string text = std::string(sample_columns) + "\n";
  for (std::uint64_t i = 0; i < count; ++i)
    text += std::to_string(i) + ",0.001,1,2,0,0,0,0,1.5,1.25" + (i % 7 == 0 ? "" : "0000") + ",0,0,0,0,0,1\n";
  const auto write = [&](const std::string& end) { std::ofstream(file, std::ios::binary) << text << end; };
  const auto count_rows = [&](bool truncated) {
    SampleReader reader(file);
    std::uint64_t rows = 0;
    for (LogRecord row; reader.next(row); ++rows)
      if (row.tick != rows || row.voltage_v != 1.25) return std::uint64_t{0};
    EXPECT_EQ(reader.truncated(), truncated);
    return rows;
  };
  write("");
  ASSERT_GT(fs::file_size(file), 2u << 20);
  EXPECT_EQ(count_rows(false), count);
  write("60000,0.0");
  EXPECT_EQ(count_rows(true), count);
  write(std::string(3 << 20, '\0'));
  EXPECT_EQ(count_rows(true), count);
  write(std::string(3 << 20, 'x') + "\n");
  EXPECT_THROW(count_rows(true), ConfigError);
}

RigReading unfresh(RigStatus status, RigFault fault) {
  RigReading reading;
  reading.status = status;
  reading.fault = fault;
  return reading;
}

TEST(LinkCounts, CountByCauseWhatALinkDidWrong) {
  LinkCounts counts;
  RigReading fresh;
  fresh.status = RigStatus::fresh;
  counts.add(fresh);
  EXPECT_EQ(sentence_of(counts), "");
  for (int i = 0; i < 3; ++i) counts.add(unfresh(RigStatus::stale, RigFault::link_timeout));
  counts.add(fresh);
  counts.add(unfresh(RigStatus::fault, RigFault::corrupt_reply));
  counts.add(unfresh(RigStatus::fault, RigFault::link_lost));
  fresh.recoveries = 2;
  counts.add(fresh);
  for (const RigFault pressed : {RigFault::emergency_stop, RigFault::limit_switch,
                                 RigFault::limit_switch_plus, RigFault::limit_switch_minus})
    counts.add(unfresh(RigStatus::fault, pressed));
  EXPECT_EQ(counts.of(LinkTrouble::late), 3u);
  EXPECT_EQ(counts.of(LinkTrouble::wrong_reply), 1u);
  EXPECT_EQ(counts.of(LinkTrouble::no_connection), 1u);
  EXPECT_EQ(
      counts.of(LinkTrouble::no_reply) + counts.of(LinkTrouble::refused) + counts.of(LinkTrouble::other), 0u)
      << "an emergency stop is no fault of the link";
  EXPECT_EQ(counts.longest, 3u);
  EXPECT_EQ(sentence_of(counts),
            "3 late replies, 1 period without a connection, 1 invalid reply, at most 3 in a row; the link "
            "was re-established 2 times");
}

TEST(RunDirectory, NeverReusesAName) {
  TemporaryFolder folder;
  std::set<fs::path> names;
  for (int i = 0; i < 5; ++i) names.insert(RunDirectory(folder.path(), "same").path());
  EXPECT_EQ(names.size(), 5u);
  EXPECT_THROW(RunDirectory(folder.path(), "../else"), ConfigError);
  EXPECT_THROW(RunDirectory(folder.path(), ""), ConfigError);
  EXPECT_THROW(RunDirectory("/proc/none/here", "x"), ConfigError);
}

}  // namespace
}  // namespace upright
