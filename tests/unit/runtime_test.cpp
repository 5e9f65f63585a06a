#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <functional>
#include <numbers>
#include <set>

#include "simulated_session.hpp"
#include "temporary_folder.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"
#include "upright/hal/simulated_rig.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/record/replay.hpp"
#include "upright/runtime/session.hpp"

namespace upright {
namespace {

namespace fs = std::filesystem;

using test::run_on;
using test::setup_for;
using test::simulated_file;
using test::TemporaryFolder;
using test::TestRun;
using test::text_of;

/// A rig around another that a test can make fail; remembers what was written last.
class TamperedRig final : public Rig {
 public:
  explicit TamperedRig(Rig& rig) : rig_(rig) {}
  void open() override { rig_.open(); }
  RigReading read() noexcept override {
    RigReading reading = rig_.read();
    if (on_read) on_read(reads, reading);
    ++reads;
    return reading;
  }
  RigFault write(double voltage_v) noexcept override {
    last_v = voltage_v;
    ++writes;
    const RigFault fault = rig_.write(voltage_v);
    return on_write ? on_write(writes) : fault;
  }
  StopReport stop() noexcept override {
    last_v = 0.0;
    stopped = true;
    ++stops;
    const StopReport report = rig_.stop();
    return on_stop ? on_stop(stops) : report;
  }
  int last_exception() const noexcept override { return exception; }

  std::function<void(int, RigReading&)> on_read;
  std::function<RigFault(int)> on_write;
  std::function<StopReport(int)> on_stop;
  int reads = 0, writes = 0, stops = 0, exception = 0;
  double last_v = 0.0;
  bool stopped = false;

 private:
  Rig& rig_;
};

TestRun run_tampered(const TemporaryFolder& folder, const RunSetup& setup,
                     const std::function<void(TamperedRig&, Clock&)>& tamper = {}, int signal_number = 0) {
  VirtualClock clock;
  const auto plain = make_simulated_rig(setup.rig, clock, {setup.seed, setup.theta0_rad});
  TamperedRig rig(*plain);
  if (tamper) tamper(rig, clock);
  return run_on(rig, clock, folder, setup, signal_number);
}

TEST(Session, BalancesForAMinuteOnAllThreeFrictions) {
  TemporaryFolder folder;
  for (const char* plant : {"viscous", "exponential", "dynamic"}) {
    const TestRun run = run_tampered(folder, setup_for(simulated_file(plant), 60.0));
    EXPECT_EQ(run.result.outcome.reason, StopReason::duration) << plant;
    ASSERT_EQ(run.record.samples.rows.size(), 60000u) << plant;
    double low = 1.0, high = -1.0;
    for (std::size_t i = 40000; i < 60000; ++i) {
      low = std::min(low, run.record.samples.rows[i].theta_rad);
      high = std::max(high, run.record.samples.rows[i].theta_rad);
    }
    constexpr double count_rad = 2.0 * std::numbers::pi / 4096.0;
    // Stick-slip makes a limit cycle of several counts; viscous friction alone leaves no more than
    // quantisation.
    if (plant == std::string("viscous"))
      EXPECT_LE(high - low, 3.0 * count_rad);
    else
      EXPECT_GT(high - low, count_rad) << plant;
    EXPECT_LT(high - low, 0.02) << plant;
  }
}

TEST(Session, NamesTheExceptionBehindAFault) {
  TemporaryFolder folder;
  const TestRun run = run_tampered(folder, setup_for(simulated_file(), 2.0), [](TamperedRig& rig, Clock&) {
    rig.exception = 6;
    rig.on_read = [](int i, RigReading& reading) {
      if (i < 100) return;
      reading.status = RigStatus::fault;
      reading.fault = RigFault::device_busy;
    };
  });
  EXPECT_EQ(run.result.outcome.exception, 6);
  EXPECT_NE(run.record.outcome->text("sentence").find("exception 06 (device busy)"), std::string::npos);
}

TEST(Session, WaitsForZeroVoltsAndSaysWhetherItIsConfirmed) {
  TemporaryFolder folder;
  for (const bool comes : {true, false}) {
    const TestRun run = run_tampered(folder, setup_for(simulated_file(), 0.5), [=](TamperedRig& rig, Clock&) {
      rig.on_stop = [=](int times) {
        StopReport report;
        report.zero_confirmed = comes && times > 100;
        report.fault = RigFault::link_timeout;
        return report;
      };
    });
    EXPECT_EQ(run.result.outcome.reason, StopReason::duration);
    EXPECT_EQ(run.result.outcome.stop.done(), comes);
    EXPECT_EQ(run.record.outcome->text("zero_volts"), comes ? "confirmed" : "not_confirmed");
    EXPECT_EQ(run.record.samples.rows.size(), 500u) << "one that lasted has its periods and no row more";
  }
}

/// The voltage of a pose that has passed is not given again when periods were missed meanwhile, nor that of a
/// cycle which stood still before it.
TEST(Session, SendsNoOldVoltageAfterAGap) {
  TemporaryFolder folder;
  constexpr int gap = 200;
  int writes_before = 0, writes_held_up = -1, writes_in_gap = -1;
  run_tampered(folder, setup_for(simulated_file(), 1.0), [&](TamperedRig& rig, Clock& clock) {
    rig.on_read = [&](int i, RigReading& reading) {
      if (i == gap) {
        writes_before = rig.writes;
        clock.sleep_until(clock.now_ns() + 4'200'000);
      }
      if (i == gap + 1) writes_held_up = rig.writes - writes_before;
      if (i > gap && i <= gap + 3) reading.status = RigStatus::stale;
      if (i == gap + 4) writes_in_gap = rig.writes - writes_before;
    };
  });
  EXPECT_EQ(writes_held_up, 0);
  EXPECT_EQ(writes_in_gap, 0);
}

/// A read that took more periods than may be late is slowness, not missing counts nor a lost link.
TEST(Session, AReadThatStandsStillIsAnOverrun) {
  constexpr int held_up = 200;
  for (const RigStatus status : {RigStatus::fresh, RigStatus::stale, RigStatus::fault}) {
    TemporaryFolder folder;
    const auto run =
        run_tampered(folder, setup_for(simulated_file(), 1.0), [&](TamperedRig& rig, Clock& clock) {
          rig.on_read = [&](int i, RigReading& reading) {
            if (i != held_up) return;
            clock.sleep_until(clock.now_ns() + 250'000'000);
            reading.status = status;
            if (status == RigStatus::fault) reading.fault = RigFault::link_timeout;
          };
        });
    EXPECT_EQ(run.result.outcome.reason, StopReason::overrun);
  }
}

TEST(Session, SameSeedSameBytesAndAnotherSeedOthers) {
  TemporaryFolder folder;
  RigFile rig = simulated_file();
  rig.simulated->cart_noise_m = 2e-5;
  rig.simulated->theta_noise_rad = 1e-3;
  rig.simulated->timing_jitter_s = 1e-4;
  RunSetup setup = setup_for(rig, 3.0);
  const auto bytes = [&] { return text_of(run_tampered(folder, setup).result.directory / "samples.csv"); };
  const std::string first = bytes(), second = bytes();
  EXPECT_EQ(first, second);
  setup.seed = 2;
  EXPECT_NE(first, bytes());
}

LoopOutcome ended_by(StopReason reason, std::uint64_t tick) {
  LoopOutcome outcome;
  outcome.reason = reason;
  outcome.first_bad_tick = tick;
  outcome.time_s = 0.001 * static_cast<double>(tick);
  return outcome;
}

bool says(const std::string& sentence, const std::string& part) {
  return sentence.find(part) != std::string::npos;
}

TEST(SentenceOfAnEnd, SuspectsSignsOnlyOnARealRigThatNobodyChecked) {
  LoopLimits limits{.track_limit_m = 0.35, .fall_angle_rad = 0.6, .watchdog_s = 0.1};
  for (const StopReason reason : {StopReason::fell, StopReason::track_limit}) {
    const LoopOutcome soon = ended_by(reason, 400), late = ended_by(reason, 9000),
                      at_once = ended_by(reason, 0);
    EXPECT_FALSE(says(sentence_of(soon, limits), "signs")) << "a simulated rig, or one that was checked";
    LoopLimits unproven = limits;
    unproven.signs_unproven = true;
    EXPECT_TRUE(says(sentence_of(soon, unproven), "check the signs"));
    EXPECT_FALSE(says(sentence_of(late, unproven), "signs")) << "it balanced before";
    EXPECT_FALSE(says(sentence_of(at_once, unproven), "signs"))
        << "nobody lifted it, or the cart was at the end";
    unproven.delay_exceeded = true;
    EXPECT_FALSE(says(sentence_of(soon, unproven), "signs"));
    EXPECT_TRUE(says(sentence_of(soon, unproven), "upright margin"));
  }
}

TEST(RigLimits, KnowWhetherSomebodyCheckedTheSigns) {
  const RigFile simulated = simulated_file();
  EXPECT_FALSE(rig_limits(simulated, read_plant_file(simulated.simulated->plant)).signs_unproven);
  const RigFile unchecked = read_rig_file(UPRIGHT_SOURCE_DIR "/config/rigs/modbus-tcp.yaml");
  EXPECT_TRUE(rig_limits(unchecked, std::nullopt).signs_unproven);
}

TEST(RigLimits, AssumeAnIp02WhereNoBoundIsKnown) {
  RigFile rig = read_rig_file(UPRIGHT_SOURCE_DIR "/config/rigs/modbus-tcp.yaml");
  EXPECT_EQ(gap_of_encoder_watch(rig), "");
  rig.encoder_watch->longest_pendulum_m.reset();
  EXPECT_TRUE(says(gap_of_encoder_watch(rig), "encoder_watch does not state longest_pendulum_m"));
  EXPECT_EQ(rig_limits(rig, std::nullopt).encoders.longest_pendulum_m, 0.7);
  const Plant plant = read_plant_file(UPRIGHT_SOURCE_DIR "/config/plants/exponential.yaml");
  EXPECT_LT(rig_limits(rig, plant).encoders.longest_pendulum_m, 0.7);
}

TEST(SentenceOfAnEnd, AsksForRealTimeOnlyWhereItWasNotGranted) {
  LoopOutcome outcome = ended_by(StopReason::overrun, 500);
  outcome.counts.overruns_wake = 4;
  EXPECT_TRUE(says(sentence_of(outcome, {}), "grant it"));
  outcome.realtime = true;
  EXPECT_FALSE(says(sentence_of(outcome, {}), "grant"));
  outcome.counts.overruns_read = 9;
  EXPECT_TRUE(says(sentence_of(outcome, {}), "check the link"));
}

TEST(Session, RunsWithDelayJitterNoiseAndGapsReplayBitForBit) {
  TemporaryFolder folder;
  RigFile rig = simulated_file();
  rig.simulated->theta_noise_rad = 5e-4;
  rig.simulated->timing_jitter_s = 5e-4;
  RunSetup setup = setup_for(rig, 4.0);
  setup.control.delay_s = 0.00337;
  const TestRun run = run_tampered(folder, setup, [](TamperedRig& tampered, Clock& clock) {
    tampered.on_read = [&clock](int i, RigReading& reading) {
      if (i % 50 == 7) reading.status = RigStatus::stale;
      if (i % 90 == 31) {
        reading.status = RigStatus::fault;
        reading.fault = RigFault::corrupt_reply;
      }
      if (i % 200 == 99) clock.sleep_until(clock.now_ns() + 4'300'000);
    };
  });
  EXPECT_EQ(run.result.outcome.reason, StopReason::duration);
  EXPECT_GT(run.result.outcome.counts.stale, 0u);
  EXPECT_GT(run.result.outcome.counts.missed, 0u);
  const ReplayResult result = replay(run.record);
  EXPECT_FALSE(result.first_mismatch.has_value());
  EXPECT_EQ(result.rows, run.record.samples.rows.size());

  RunRecord changed = run.record;
  changed.samples.rows[1234].pendulum_counts += 1;
  ASSERT_TRUE(replay(changed).first_mismatch.has_value());
  RunRecord other_gain = run.record;
  other_gain.control.gains.cart_position_v_per_m = std::nextafter(70.7107, 71.0);
  EXPECT_TRUE(replay(other_gain).first_mismatch.has_value());
}

TEST(Session, NamesTheWholeConfigurationAndTheOutcome) {
  TemporaryFolder folder;
  const RunSetup setup = setup_for(simulated_file(), 0.5);
  const TestRun run = run_tampered(folder, setup);
  EXPECT_TRUE(run.result.outcome_written);
  EXPECT_EQ(run.record.control.gains.pendulum_angle_v_per_rad, setup.control.gains.pendulum_angle_v_per_rad);
  EXPECT_EQ(run.record.rig.calibration.cart.per_count, setup.rig.calibration.cart.per_count);
  ASSERT_TRUE(run.record.outcome.has_value());
  EXPECT_EQ(run.record.outcome->text("reason"), "duration");
  EXPECT_EQ(run.record.document.map("provenance").text("version").empty(), false);
  std::set<std::string> files;
  for (const auto& entry : fs::directory_iterator(run.result.directory))
    files.insert(entry.path().filename());
  EXPECT_EQ(files, (std::set<std::string>{"run.yaml", "samples.csv"}));
}

struct Trouble {
  const char* what;
  StopReason reason;
  std::function<void(TamperedRig&, Clock&)> tamper;
};

TEST(Session, ARigsFaultIsNamedWithItsOwnRemedy) {
  LoopOutcome outcome;
  const auto says = [&](StopReason reason, RigFault fault, const char* words) {
    outcome.reason = reason;
    outcome.fault = fault;
    const std::string sentence = sentence_of(outcome, {});
    EXPECT_NE(sentence.find(words), std::string::npos) << sentence;
  };
  says(StopReason::track_limit, RigFault::limit_switch_plus, "the limit switch at the +x end");
  says(StopReason::track_limit, RigFault::limit_switch_minus, "the limit switch at the -x end");
  says(StopReason::rig_fault, RigFault::line_failed, "check the GPIO chip");
  says(StopReason::rig_fault, RigFault::edges_lost, "encoder edges were lost");
  says(StopReason::rig_fault, RigFault::edges_too_fast, "turn the encoder more slowly");
  says(StopReason::rig_fault, RigFault::device_restarted, "reset the device");
}

TEST(Session, EveryTroubleEndsInZeroVoltsWithItsReasonAndItsCycle) {
  constexpr int bad = 300;
  const auto always = [](RigStatus status, RigFault fault) {
    return [=](TamperedRig& rig, Clock&) {
      rig.on_read = [=](int i, RigReading& reading) {
        if (i < bad) return;
        reading.status = status;
        reading.fault = fault;
      };
    };
  };
  const std::vector<Trouble> troubles = {
      {"stale", StopReason::stale_encoder, always(RigStatus::stale, RigFault::none)},
      {"timeout", StopReason::link_lost, always(RigStatus::fault, RigFault::link_timeout)},
      {"lost", StopReason::link_lost, always(RigStatus::fault, RigFault::link_lost)},
      {"corrupt", StopReason::link_lost, always(RigStatus::fault, RigFault::corrupt_reply)},
      {"busy", StopReason::link_lost, always(RigStatus::fault, RigFault::device_busy)},
      {"refused", StopReason::rig_fault, always(RigStatus::fault, RigFault::device_refused)},
      {"restarted", StopReason::rig_fault, always(RigStatus::fault, RigFault::device_restarted)},
      {"e-stop", StopReason::emergency_stop, always(RigStatus::fault, RigFault::emergency_stop)},
      {"limit switch", StopReason::track_limit, always(RigStatus::fault, RigFault::limit_switch)},
      {"limit switch at +x", StopReason::track_limit, always(RigStatus::fault, RigFault::limit_switch_plus)},
      {"limit switch at -x", StopReason::track_limit, always(RigStatus::fault, RigFault::limit_switch_minus)},
      {"line", StopReason::rig_fault, always(RigStatus::fault, RigFault::line_failed)},
      {"edges lost", StopReason::rig_fault, always(RigStatus::fault, RigFault::edges_lost)},
      {"edges too fast", StopReason::rig_fault, always(RigStatus::fault, RigFault::edges_too_fast)},
      {"track", StopReason::track_limit,
       [](TamperedRig& rig, Clock&) {
         rig.on_read = [](int i, RigReading& reading) {
           if (i >= bad) reading.cart_counts += 20000;
         };
       }},
      {"fall", StopReason::fell,
       [](TamperedRig& rig, Clock&) {
         rig.on_read = [](int i, RigReading& reading) {
           if (i >= bad) reading.pendulum_counts -= 500;
         };
       }},
      {"stuck", StopReason::stuck_encoder,
       [](TamperedRig& rig, Clock&) {
         rig.on_read = [last = std::int64_t{0}](int i, RigReading& reading) mutable {
           if (i < bad) last = reading.cart_counts;
           reading.cart_counts = last;
         };
       }},
      {"write", StopReason::link_lost,
       [](TamperedRig& rig, Clock&) {
         rig.on_write = [](int i) { return i > bad ? RigFault::link_timeout : RigFault::none; };
       }},
      {"overrun", StopReason::overrun,
       [](TamperedRig& rig, Clock& clock) {
         rig.on_read = [&clock](int i, RigReading&) {
           if (i >= bad) clock.sleep_until(clock.now_ns() + 1'500'000);
         };
       }},
  };
  TemporaryFolder folder;
  for (const Trouble& trouble : troubles) {
    const TestRun run = run_tampered(folder, setup_for(simulated_file(), 5.0), trouble.tamper);
    EXPECT_EQ(run.result.outcome.reason, trouble.reason) << trouble.what;
    EXPECT_NEAR(static_cast<double>(run.result.outcome.first_bad_tick), bad, 1.0) << trouble.what;
    // An encoder that sticks is noticed by what the motor does meanwhile.
    const double noticed_s = trouble.reason == StopReason::stuck_encoder ? 1.0 : 0.1 + 0.06;
    EXPECT_LE(run.result.outcome.time_s, 0.001 * bad + noticed_s) << trouble.what;
    EXPECT_TRUE(run.stopped) << trouble.what;
    EXPECT_EQ(run.last_v, 0.0) << trouble.what;
    EXPECT_EQ(run.record.samples.rows.back().voltage_v, 0.0) << trouble.what;
    EXPECT_TRUE(run.record.samples.rows.back().flags & row_flag::stopped) << trouble.what;
    ASSERT_TRUE(run.record.outcome.has_value());
    EXPECT_EQ(run.record.outcome->text("reason"), name_of(trouble.reason));
    EXPECT_EQ(run.record.outcome->text("sentence").find('\n'), std::string::npos);
    EXPECT_FALSE(replay(run.record).first_mismatch.has_value()) << trouble.what;
  }
}

TEST(Session, GoesOnThroughTroubleThatPassesWithinTheWatchdogTime) {
  TemporaryFolder folder;
  const TestRun run = run_tampered(folder, setup_for(simulated_file(), 5.0), [](TamperedRig& rig, Clock&) {
    rig.on_read = [](int i, RigReading& reading) {
      if (i % 500 < 480 || i < 100) return;
      reading.status = RigStatus::fault;
      reading.fault = RigFault::link_timeout;
      reading.pendulum_counts = 1'000'000;  // must never be looked at
    };
  });
  EXPECT_EQ(run.result.outcome.reason, StopReason::duration);
  EXPECT_EQ(run.result.outcome.counts.faults, 200u);
}

TEST(Session, SaysWhatARunWentOnAfter) {
  TemporaryFolder folder;
  const TestRun run = run_tampered(folder, setup_for(simulated_file(), 2.0), [](TamperedRig& rig, Clock&) {
    rig.on_read = [](int i, RigReading& reading) {
      if (i > 1000) reading.recoveries = 1;
      if (i == 500 || i == 501) reading.status = RigStatus::stale;
      if (i == 800) {
        reading.status = RigStatus::fault;
        reading.fault = RigFault::link_timeout;
      }
    };
  });
  ASSERT_TRUE(run.record.outcome.has_value());
  const YamlMap link = run.record.outcome->map("link");
  EXPECT_EQ(link.number("late_reply"), 2.0);
  EXPECT_EQ(link.number("no_reply"), 1.0);
  EXPECT_EQ(link.number("wrong_reply"), 0.0);
  EXPECT_EQ(link.number("longest"), 2.0);
  EXPECT_EQ(link.number("recoveries"), 1.0);
  EXPECT_EQ(
      run.record.outcome->text("sentence"),
      "the run completed its full duration despite 2 late replies, 1 missing reply, at most 2 in a row; "
      "the link was re-established 1 time");
}

TEST(Session, AttributesAnOverrunToTheStepThatTookTheTime) {
  TemporaryFolder folder;
  const TestRun run =
      run_tampered(folder, setup_for(simulated_file(), 1.0), [](TamperedRig& rig, Clock& clock) {
        rig.on_read = [&clock](int i, RigReading&) {
          if (i == 100) clock.sleep_until(clock.now_ns() + 1'200'000);
        };
        rig.on_write = [&clock](int i) {
          if (i == 301) clock.sleep_until(clock.now_ns() + 3'200'000);
          return RigFault::none;
        };
      });
  const LoopCounts& counts = run.result.outcome.counts;
  EXPECT_EQ(counts.overruns_read, 1u);
  EXPECT_EQ(counts.overruns_write, 1u);
  EXPECT_EQ(counts.overruns_compute, 0u);
  EXPECT_EQ(counts.missed, 2u);
  EXPECT_TRUE(run.record.samples.rows[100].flags & row_flag::overrun_read);
  EXPECT_TRUE(run.record.samples.rows[300].flags & row_flag::overrun_write);
}

TEST(Session, StopsWhereTheCartWouldRollToTheTrackLimit) {
  TemporaryFolder folder;
  RunSetup setup = setup_for(simulated_file(), 5.0);
  setup.rig.calibration.cart.sign = -1;  // the plant counts as before: a runaway
  const auto run_with = [&](double coast_s) {
    setup.limits.coast_s = coast_s;
    VirtualClock clock;
    const auto plant = make_simulated_rig(simulated_file(), clock, {setup.seed, setup.theta0_rad});
    plant->open();
    const SignalFlag signal{0};
    SessionOptions options;
    options.out = folder.path();
    const SessionResult result = run_session(setup, *plant, clock, signal, std::move(options));
    EXPECT_EQ(result.outcome.reason, StopReason::track_limit);
    for (int i = 0; i < 1000; ++i) {
      clock.sleep_until(clock.now_ns() + 1'000'000);
      plant->read();
    }
    return 2.27485e-5 * static_cast<double>(std::abs(plant->read().cart_counts));
  };
  constexpr double track_end_m = 0.407;
  EXPECT_GT(run_with(0.0), track_end_m);
  EXPECT_LT(run_with(0.1), track_end_m);
}

TEST(Session, GivesNoVoltageAfterTooManyMissedPeriods) {
  TemporaryFolder folder;
  int writes_before = 0;
  const TestRun run =
      run_tampered(folder, setup_for(simulated_file(), 5.0), [&](TamperedRig& rig, Clock& clock) {
        rig.on_write = [&](int i) {
          if (i == 300) clock.sleep_until(clock.now_ns() + 100'000'000);
          writes_before = i;
          return RigFault::none;
        };
      });
  EXPECT_EQ(run.result.outcome.reason, StopReason::overrun);
  EXPECT_EQ(writes_before, 300) << "not even one more";
  EXPECT_EQ(run.record.samples.rows.size(), 301u);
  EXPECT_TRUE(run.record.samples.rows.back().flags & row_flag::stopped);
  EXPECT_FALSE(replay(run.record).first_mismatch.has_value());
}

TEST(Session, ASignalStopsBeforeAnotherVoltageIsWritten) {
  TemporaryFolder folder;
  const TestRun run = run_tampered(folder, setup_for(simulated_file(), 5.0), {}, SIGTERM);
  EXPECT_EQ(run.result.outcome.reason, StopReason::signal);
  EXPECT_TRUE(run.stopped);
  ASSERT_EQ(run.record.samples.rows.size(), 1u) << "the stop's own";
  EXPECT_EQ(run.record.samples.rows.back().voltage_v, 0.0);
  EXPECT_TRUE(run.record.samples.rows.back().flags & row_flag::stopped);
  EXPECT_FALSE(replay(run.record).first_mismatch.has_value());
  EXPECT_NE(run.record.outcome->text("sentence").find("SIGTERM"), std::string::npos);
}

TEST(Session, AFullDiskStopsTheMotorAndKeepsTheRows) {
  // A limit on file size fails a write as a full disk does.
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limited = before;
  limited.rlim_cur = 300'000;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limited), 0);
  TemporaryFolder folder;
  const TestRun run = run_tampered(folder, setup_for(simulated_file(), 600.0));
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(run.result.outcome.reason, StopReason::log_failed);
  EXPECT_TRUE(run.stopped);
  EXPECT_FALSE(run.record.samples.truncated);
  EXPECT_EQ(run.record.samples.rows.size(), run.result.log.rows_written);
  EXPECT_GT(run.record.samples.rows.size(), 1000u);
  EXPECT_TRUE(run.record.outcome.has_value());
  EXPECT_FALSE(replay(run.record).first_mismatch.has_value());
}

TEST(Session, LogsTheSpinAndRefusesOneOfMostOfThePeriod) {
  TemporaryFolder folder;
  RunSetup setup = setup_for(simulated_file(), 0.2);
  setup.rig.spin_us = 200.0;
  MonotonicClock clock;
  const auto run_with = [&](std::optional<double> spin_us) {
    const auto rig = make_simulated_rig(setup.rig, clock, {setup.seed, setup.theta0_rad});
    rig->open();
    const SignalFlag signal{0};
    SessionOptions options;
    options.out = folder.path();
    options.realtime.spin_us = spin_us;
    const SessionResult result = run_session(setup, *rig, clock, signal, std::move(options));
    return YamlMap::from_file(result.directory / "run.yaml").map("loop").number("spin_us");
  };
  EXPECT_EQ(run_with({}), 200.0);
  EXPECT_EQ(run_with(60.0), 60.0);
  EXPECT_EQ(run_with(0.0), 0.0);
  EXPECT_THROW(run_with(600.0), ConfigError);
}

/// A clock on which sleeping costs no time, and the loop waits for nobody.
class HurriedClock final : public Clock {
 public:
  std::int64_t now_ns() noexcept override { return clock_.now_ns(); }
  void sleep_until(std::int64_t time_ns) noexcept override { clock_.sleep_until(time_ns); }
  bool is_virtual() const noexcept override { return false; }

 private:
  VirtualClock clock_;
};

TEST(Session, ALogThatLosesRowsStopsTheMotorAndSaysSo) {
  TemporaryFolder folder;
  const RunSetup setup = setup_for(simulated_file(), 20.0);
  HurriedClock clock;
  const auto plain = make_simulated_rig(setup.rig, clock, {setup.seed, setup.theta0_rad});
  TamperedRig rig(*plain);
  rig.open();
  const SignalFlag signal{0};
  SessionOptions options;
  options.out = folder.path();
  options.log_queue_rows = 2;  // the writer comes every 10 ms
  const SessionResult result = run_session(setup, rig, clock, signal, std::move(options));
  EXPECT_EQ(result.outcome.reason, StopReason::log_failed);
  EXPECT_LT(result.outcome.time_s, 1.0);
  EXPECT_TRUE(rig.stopped);
  EXPECT_EQ(rig.last_v, 0.0);
  EXPECT_GT(result.log.rows_dropped, 0u);
  const RunRecord record = read_run(result.directory);
  ASSERT_TRUE(record.outcome.has_value());
  EXPECT_EQ(record.outcome->text("reason"), "log_failed");
  EXPECT_NE(record.outcome->text("log_failure").find("rows were lost"), std::string::npos);
}

}  // namespace
}  // namespace upright
