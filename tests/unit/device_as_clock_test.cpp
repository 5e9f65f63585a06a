// The loop on a device that is the clock: drift, loss, and a device that stops sampling.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "simulated_session.hpp"
#include "upright/base/yaml_reader.hpp"
#include "upright/record/replay.hpp"

namespace upright {
namespace {

using test::run_on;
using test::setup_for;
using test::simulated_file;
using test::TemporaryFolder;
using test::TestRun;

/// The simulated rig on a device that samples on its own time: a reading without a new sample is none.
class ClockedRig final : public Rig {
 public:
  ClockedRig(Rig& rig, Clock& clock) : rig_(rig), clock_(clock) {}
  void open() override { rig_.open(); }
  RigFault write(double voltage_v) noexcept override { return rig_.write(last_v = voltage_v); }
  StopReport stop() noexcept override {
    last_v = 0.0;
    stopped = true;
    return rig_.stop();
  }
  bool is_clock() const noexcept override { return true; }
  DeviceSample wait_next(std::int64_t until_ns) noexcept override {
    int next = waited_for_ + 1;
    while (is_dropped(next)) ++next;
    clock_.sleep_until(std::min(until_ns, time_ns(next)));
    for (int newer = next; time_ns(newer) <= clock_.now_ns(); ++newer)
      if (!is_dropped(newer)) waited_for_ = newer;
    return {number(waited_for_), time_ns(waited_for_)};
  }
  RigReading read() noexcept override {
    RigReading reading = rig_.read();
    if (on_read) on_read(reads++);
    if (waited_for_ == read_) {
      reading.status = RigStatus::fault;
      reading.fault = RigFault::link_timeout;
    }
    read_ = waited_for_;
    return reading;
  }

  double ppm = 0.0;
  int drop_every = 0, stops_at = 1'000'000;
  std::function<void(int)> on_read;
  double last_v = 0.0;
  int reads = 0;
  bool stopped = false;

 private:
  static constexpr std::int64_t never_ns = 1'000'000'000'000'000;

  std::int64_t time_ns(int sample) const {
    return sample >= stops_at ? never_ns : std::llround(1e6 * (1.0 + 1e-6 * ppm) * sample);
  }
  bool is_dropped(int sample) const {
    return drop_every > 0 && sample % drop_every == 0 && sample < stops_at;
  }
  std::uint64_t number(int sample) const {
    return static_cast<std::uint64_t>(sample - (drop_every > 0 ? sample / drop_every : 0));
  }

  Rig& rig_;
  Clock& clock_;
  int waited_for_ = 0, read_ = 0;
};

TestRun run_clocked(const TemporaryFolder& folder, const RunSetup& setup,
                    const std::function<void(ClockedRig&, Clock&)>& arrange) {
  VirtualClock clock;
  const auto plain = make_simulated_rig(setup.rig, clock, {setup.seed, setup.theta0_rad});
  ClockedRig rig(*plain, clock);
  arrange(rig, clock);
  return run_on(rig, clock, folder, setup);
}

TEST(DeviceAsClock, IsFollowedAndItsDriftAndLossReported) {
  TemporaryFolder folder;
  const TestRun run =
      run_clocked(folder, setup_for(simulated_file(), 4.0), [](ClockedRig& rig, Clock& clock) {
        rig.ppm = 500.0;
        rig.drop_every = 20;
        rig.on_read = [&clock](int i) {
          if (i == 1234) clock.sleep_until(clock.now_ns() + 4'300'000);
        };
      });
  const LoopOutcome& outcome = run.result.outcome;
  EXPECT_EQ(outcome.reason, StopReason::duration);
  EXPECT_NEAR(outcome.time_s, 4.0 * 1.0005, 1e-3) << "by the device's clock";
  EXPECT_GE(outcome.counts.missed, 3u) << "the same rules for a cycle that takes too long";
  EXPECT_EQ(outcome.counts.periods + outcome.counts.missed, 4000u);
  EXPECT_EQ(outcome.counts.overruns_read, 1u);
  ASSERT_TRUE(outcome.device_clock.has_value());
  EXPECT_NEAR(outcome.device_clock->drift_ppm, 500.0, 1.0);
  EXPECT_NEAR(static_cast<double>(outcome.device_clock->lost), 200.0, 1.0);
  EXPECT_NEAR(static_cast<double>(outcome.counts.faults), 200.0, 1.0);
  const YamlMap reported = run.record.outcome->map("device_clock");
  EXPECT_EQ(reported.number("drift_ppm"), outcome.device_clock->drift_ppm);
  EXPECT_EQ(reported.integer("lost", 0, 1000), static_cast<std::int64_t>(outcome.device_clock->lost));
  const std::vector<LogRecord>& rows = run.record.samples.rows;
  EXPECT_EQ(rows.front().time_ns, 0);
  EXPECT_EQ(rows[11].time_ns - rows[10].time_ns, 1'000'500) << "a row is as old as its sample";
  EXPECT_FALSE(replay(run.record).first_mismatch.has_value());
}

TEST(DeviceAsClock, ThatStopsSamplingIsALostLink) {
  TemporaryFolder folder;
  const TestRun run = run_clocked(folder, setup_for(simulated_file(), 4.0),
                                  [](ClockedRig& rig, Clock&) { rig.stops_at = 301; });
  EXPECT_EQ(run.result.outcome.reason, StopReason::link_lost);
  EXPECT_EQ(run.result.outcome.first_bad_tick, 300u);
  EXPECT_LE(run.result.outcome.time_s, 0.3 + 0.1 + 0.002) << "the watchdog's time, and two periods";
  EXPECT_EQ(run.last_v, 0.0);
  EXPECT_TRUE(run.record.samples.rows.back().flags & row_flag::stopped);
  EXPECT_NE(run.record.outcome->text("sentence").find("no reply in time"), std::string::npos);
  EXPECT_FALSE(replay(run.record).first_mismatch.has_value());
}

TEST(DeviceAsClock, OneThatNeverSamplesIsALostLinkToo) {
  TemporaryFolder folder;
  const TestRun run = run_clocked(folder, setup_for(simulated_file(), 4.0),
                                  [](ClockedRig& rig, Clock&) { rig.stops_at = 1; });
  EXPECT_EQ(run.result.outcome.reason, StopReason::link_lost);
  EXPECT_EQ(run.result.outcome.first_bad_tick, 0u);
  EXPECT_EQ(run.result.outcome.device_clock->samples, 0u);
}

TEST(DeviceAsClock, ALoopThatStandsStillStopsAsWithATimer) {
  TemporaryFolder folder;
  const TestRun run =
      run_clocked(folder, setup_for(simulated_file(), 4.0), [](ClockedRig& rig, Clock& clock) {
        rig.on_read = [&clock](int i) {
          if (i == 300) clock.sleep_until(clock.now_ns() + 100'000'000);
        };
      });
  EXPECT_EQ(run.result.outcome.reason, StopReason::overrun);
  EXPECT_EQ(run.last_v, 0.0);
  EXPECT_FALSE(replay(run.record).first_mismatch.has_value());
}

}  // namespace
}  // namespace upright
