// What `upright doctor` concludes from what it finds, without a machine or a rig that has it.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <numbers>
#include <sstream>
#include <string>

#include "commissioning/machine_check.hpp"
#include "commissioning/machine_fix.hpp"
#include "commissioning/rig_check.hpp"
#include "commissioning/wake_probe.hpp"
#include "record/histogram_text.hpp"
#include "runtime/cpu_latency.hpp"

namespace upright {
namespace {

namespace fs = std::filesystem;

/// A folder that stands for the root of a machine.
class FakeRoot {
 public:
  FakeRoot() {
    std::string name = (fs::temp_directory_path() / "upright-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  ~FakeRoot() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  FakeRoot(const FakeRoot&) = delete;
  FakeRoot& operator=(const FakeRoot&) = delete;
  const fs::path& path() const { return path_; }
  void put(const std::string& name, const std::string& text) const {
    fs::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name) << text;
  }

 private:
  fs::path path_;
};

const Finding& about(const std::vector<Finding>& findings, const std::string& subject) {
  for (const Finding& finding : findings)
    if (finding.subject == subject) return finding;
  throw std::runtime_error("nothing about " + subject);
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

TEST(MachineFix, MakesTheGroupWhereNoPackageDid) {
  const FakeRoot root;
  const std::vector<Finding> findings{{"rtprio", Health::poor, "limited to 0", "join the group"},
                                      {"kernel", Health::good, "PREEMPT_RT", ""}};
  const std::string text = joined(commands_to_fix(findings, "ada", root.path()));
  for (const char* part : {"groupadd --force --system upright\n", "cat >/etc/security/limits.d/upright.conf",
                           "@upright - rtprio 90\n", "KERNEL==\"cpu_dma_latency\", GROUP=\"upright\"",
                           "usermod --append --groups upright ada "})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(text.find("linux-image"), std::string::npos) << text;
}

TEST(MachineFix, OnlyJoinsTheGroupThatThePackageMade) {
  const FakeRoot root;
  root.put("etc/security/limits.d/upright.conf", "");
  root.put("usr/lib/udev/rules.d/60-upright.rules", "");
  const std::vector<Finding> findings{{"sleep states", Health::poor, "cannot be written", "a rule"}};
  const std::string text = joined(commands_to_fix(findings, "ada", root.path()));
  EXPECT_EQ(text.find("cat >"), std::string::npos) << text;
  EXPECT_NE(text.find("usermod --append --groups upright ada "), std::string::npos) << text;
}

TEST(MachineFix, LeavesBootOptionsToThePerson) {
  const FakeRoot root;
  const std::vector<Finding> findings{{"timer tick", Health::poor, "has it", "boot with nohz_full=1"}};
  for (const std::string& line : commands_to_fix(findings, "ada", root.path()))
    EXPECT_EQ(line.front(), '#') << line;
  EXPECT_TRUE(commands_to_fix({{"timer tick", Health::good, "off", ""}}, "ada", root.path()).empty());
}

TEST(MachineCheck, KnowsAMachineThatIsWellSetUp) {
  const FakeRoot root;
  root.put("sys/kernel/realtime", "1\n");
  root.put("sys/devices/system/cpu/isolated", "3\n");
  root.put("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n");
  root.put("sys/devices/system/cpu/cpu0/cpuidle/state1/name", "C1\n");
  root.put("dev/cpu_dma_latency", "");
  const std::vector<Finding> findings = examine_machine(root.path());
  for (const char* subject : {"kernel", "processors", "governor", "sleep states"}) {
    EXPECT_EQ(about(findings, subject).health, Health::good) << subject;
    EXPECT_TRUE(about(findings, subject).remedy.empty()) << subject;
  }
}

TEST(MachineCheck, HasARemedyForEachThingThatIsPoor) {
  const FakeRoot root;
  root.put("sys/devices/system/cpu/isolated", "\n");
  root.put("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n");
  root.put("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "schedutil\n");
  root.put("sys/devices/system/cpu/cpu0/cpuidle/state1/name", "C1\n");
  const std::vector<Finding> findings = examine_machine(root.path());
  for (const char* subject : {"kernel", "processors", "governor", "sleep states"}) {
    EXPECT_EQ(about(findings, subject).health, Health::poor) << subject;
    EXPECT_FALSE(about(findings, subject).remedy.empty()) << subject;
  }
  EXPECT_EQ(verdict_of(findings), Health::poor);
}

/// A machine of four processors, two to a core, whose last one the loop would take.
void put_four_processors(const FakeRoot& root) {
  root.put("sys/devices/system/cpu/online", "0-3\n");
  root.put("sys/devices/system/cpu/cpu3/topology/thread_siblings_list", "1,3\n");
  root.put("proc/sys/kernel/sched_rt_runtime_us", "950000\n");
  root.put("proc/sys/kernel/sched_rt_period_us", "1000000\n");
}

TEST(MachineCheck, KnowsWhatElseTheLoopsProcessorDoes) {
  const FakeRoot root;
  put_four_processors(root);
  root.put("proc/cmdline", "quiet rcu_nocbs=0-1\n");
  root.put("sys/devices/system/cpu/nohz_full", "(null)\n");
  root.put("proc/irq/24/smp_affinity_list", "0-3\n");
  root.put("proc/irq/25/smp_affinity_list", "0-2\n");
  root.put("proc/irq/26/effective_affinity_list", "0\n");
  root.put("proc/irq/26/smp_affinity_list", "0-3\n");
  root.put("sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "16\n");
  root.put("sys/bus/usb-serial/devices/ttyUSB1/latency_timer", "1\n");
  const std::vector<Finding> findings = examine_machine(root.path());
  for (const char* subject : {"timer tick", "RCU callbacks", "interrupts", "core", "USB converters"}) {
    EXPECT_EQ(about(findings, subject).health, Health::poor) << subject;
    EXPECT_FALSE(about(findings, subject).remedy.empty()) << subject;
  }
  EXPECT_NE(about(findings, "timer tick").remedy.find("nohz_full=3"), std::string::npos);
  EXPECT_EQ(about(findings, "interrupts").what.find("1 of 3"), 0u) << about(findings, "interrupts").what;
  EXPECT_NE(about(findings, "USB converters").what.find("ttyUSB0 16 ms"), std::string::npos);
  EXPECT_EQ(about(findings, "USB converters").what.find("ttyUSB1"), std::string::npos);
  EXPECT_EQ(about(findings, "throttling").health, Health::good);
}

TEST(MachineCheck, KnowsAProcessorOfTheLoopsOwn) {
  const FakeRoot root;
  put_four_processors(root);
  root.put("sys/devices/system/cpu/cpu3/topology/thread_siblings_list", "3\n");
  root.put("sys/devices/system/cpu/nohz_full", "2-3\n");
  root.put("proc/irq/24/smp_affinity_list", "0-1\n");
  root.put("sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "1\n");
  const std::vector<Finding> findings = examine_machine(root.path());
  for (const char* subject :
       {"timer tick", "RCU callbacks", "interrupts", "core", "throttling", "USB converters"})
    EXPECT_EQ(about(findings, subject).health, Health::good) << subject;
}

TEST(MachineCheck, SaysWhereRealTimeThreadsGetTooLittle) {
  const FakeRoot root;
  put_four_processors(root);
  root.put("proc/sys/kernel/sched_rt_runtime_us", "500000\n");
  EXPECT_EQ(about(examine_machine(root.path()), "throttling").health, Health::poor);
  root.put("proc/sys/kernel/sched_rt_runtime_us", "-1\n");
  EXPECT_EQ(about(examine_machine(root.path()), "throttling").health, Health::good);
}

TEST(MachineCheck, JudgesWhatWasGranted) {
  RealtimeGrant grant;
  EXPECT_EQ(verdict_of(examine_grant(grant)), Health::poor);
  grant.policy = "SCHED_FIFO";
  grant.memory_locked = true;
  EXPECT_EQ(verdict_of(examine_grant(grant)), Health::good);
}

TEST(Verdict, IsTheWorstAndWhatWasNotExaminedCountsForNothing) {
  EXPECT_EQ(verdict_of({}), Health::good);
  EXPECT_EQ(verdict_of({{"a", Health::not_examined, "", ""}}), Health::good);
  EXPECT_EQ(verdict_of({{"a", Health::poor, "", ""}, {"b", Health::good, "", ""}}), Health::poor);
  EXPECT_EQ(verdict_of({{"a", Health::bad, "", ""}, {"b", Health::not_examined, "", ""}}), Health::bad);
}

DurationHistogram all_of(std::int64_t ns) {
  DurationHistogram histogram;
  for (int i = 0; i < 1000; ++i) histogram.add(ns);
  return histogram;
}

TEST(WakeUps, AreJudgedAgainstThePeriod) {
  EXPECT_EQ(judge_wake_ups("w", all_of(90'000), 0.001).health, Health::good);
  EXPECT_EQ(judge_wake_ups("w", all_of(200'000), 0.001).health, Health::poor);
  EXPECT_EQ(judge_wake_ups("w", all_of(700'000), 0.001).health, Health::bad);
  EXPECT_EQ(judge_wake_ups("w", all_of(700'000), 0.01).health, Health::good);
}

TEST(WakeUps, AreMeasuredAtTheRateThatWasAsked) {
  const WakeProbe probe = probe_wake_ups(500.0, 0.3, true, {});
  EXPECT_LE(probe.late.count(), 150u);
  EXPECT_GT(probe.late.count(), 20u) << "a busy machine misses some";
  EXPECT_FALSE(probe.grant.note.empty());
}

TEST(Link, CarriesTwoRoundTripsPerPeriod) {
  LinkProbe probe;
  probe.round_trip = all_of(1'000'000);
  EXPECT_NEAR(highest_rate_hz(probe.round_trip), 500.0, 1.0);
  EXPECT_EQ(judge_link(probe, 400.0).health, Health::good);
  EXPECT_EQ(judge_link(probe, 600.0).health, Health::poor);
  probe.failed = 5;
  EXPECT_EQ(judge_link(probe, 400.0).health, Health::poor);
  probe.failed = 100;
  EXPECT_EQ(judge_link(probe, 400.0).health, Health::bad);
  EXPECT_EQ(judge_link({}, 400.0).health, Health::bad);
}

TEST(Link, OneSlowExchangeIsNotItsRate) {
  for (const int trips : {50, 100, 500, 5000}) {
    LinkProbe probe;
    for (int i = 1; i < trips; ++i) probe.round_trip.add(500'000);
    probe.round_trip.add(4'000'000);
    EXPECT_GT(highest_rate_hz(probe.round_trip), 900.0) << trips;
  }
  LinkProbe slow;
  for (int i = 0; i < 100; ++i) slow.round_trip.add(i % 10 == 0 ? 4'000'000 : 500'000);
  EXPECT_LT(highest_rate_hz(slow.round_trip), 130.0) << "one in ten is the rate";
}

TEST(Verdict, AgreesWithTheRateThatTheLinkCarries) {
  const DurationHistogram trips = all_of(4'000'000);  // carries 125 Hz
  EXPECT_NE(verdict_sentence(Health::poor, 1000.0, &trips).find("not fit for 1000 Hz"), std::string::npos);
  EXPECT_EQ(verdict_sentence(Health::good, 100.0, &trips), "fit to run a rig");
  EXPECT_EQ(verdict_sentence(Health::poor, 100.0, &trips).rfind("fit to run a rig", 0), 0u);
  EXPECT_EQ(verdict_sentence(Health::bad, 1000.0, &trips).rfind("not fit to run a rig", 0), 0u);
  EXPECT_EQ(verdict_sentence(Health::good, 1000.0, nullptr), "fit to run a rig") << "no link was measured";
}

Calibration ip02() {
  Calibration calibration;
  calibration.cart = {2.27485e-5, 1, 32, 5.0};
  calibration.pendulum = {2.0 * std::numbers::pi / 4096.0, 1, 32, 60.0};
  return calibration;
}

TEST(Zero, IsRightWhenTheRestingPendulumHangsByIt) {
  const Calibration calibration = ip02();
  EXPECT_EQ(judge_zero({{100, 2048}, {101, 2047}}, calibration).health, Health::good);
  EXPECT_EQ(judge_zero({{100, -2048}}, calibration).health, Health::good) << "the other way round";
  const Finding off = judge_zero({{100, 1000}}, calibration);
  EXPECT_EQ(off.health, Health::poor);
  EXPECT_NE(off.remedy.find("{at: counts, cart_counts: 100, pendulum_counts: 1000, pose: hanging}"),
            std::string::npos)
      << off.remedy;
}

TEST(Zero, IsNotJudgedWhileTheRigMoves) {
  EXPECT_EQ(judge_zero({{100, 2048}, {100, 2060}}, ip02()).health, Health::not_examined);
  EXPECT_EQ(judge_zero({}, ip02()).health, Health::not_examined);
}

TEST(HandTest, TellsAgreementFromOppositionAndWaitsForAClearMove) {
  const HandTest cart(HandMove::cart_to_plus, {0.1, 3.0});
  EXPECT_EQ(cart.look({0.105, 9.0}), HandAnswer::nothing_yet);
  EXPECT_EQ(cart.look({0.13, 3.0}), HandAnswer::agrees);
  EXPECT_EQ(cart.look({0.07, 3.0}), HandAnswer::opposes);
  // The bob of a hanging pendulum at +x: theta is below pi.
  const HandTest bob(HandMove::bob_to_plus, {0.1, std::numbers::pi});
  EXPECT_EQ(bob.look({0.5, std::numbers::pi}), HandAnswer::nothing_yet);
  EXPECT_EQ(bob.look({0.1, 2.5}), HandAnswer::agrees);
  EXPECT_EQ(bob.look({0.1, 3.8}), HandAnswer::opposes);
}

/// Encoders that somebody moves.
class MovedRig final : public Rig {
 public:
  MovedRig(Clock& clock, std::function<EncoderCounts(double)> at) : clock_(clock), at_(std::move(at)) {}
  void open() override {}
  RigReading read() noexcept override {
    const EncoderCounts counts = at_(static_cast<double>(clock_.now_ns()) * 1e-9);
    RigReading reading;
    reading.cart_counts = counts.cart;
    reading.pendulum_counts = counts.pendulum;
    reading.time_ns = clock_.now_ns();
    reading.status = RigStatus::fresh;
    return reading;
  }
  RigFault write(double) noexcept override {
    ADD_FAILURE() << "a voltage was written";
    return RigFault::none;
  }
  StopReport stop() noexcept override { return at_zero_volts(); }

 private:
  Clock& clock_;
  std::function<EncoderCounts(double)> at_;
};

TEST(SignsByHand, FollowBothMovesAndWriteNothing) {
  for (const int sign : {1, -1}) {
    VirtualClock clock;
    MovedRig rig(clock, [sign](double time_s) {
      const double pushed_m = std::min(0.1, 0.05 * time_s),
                   lifted_rad = time_s < 3.0 ? 0.0 : 0.5 * (time_s - 3.0);
      return EncoderCounts{sign * std::llround(pushed_m / 2.27485e-5),
                           sign * std::llround((std::numbers::pi - lifted_rad) * 2048.0 / std::numbers::pi)};
    });
    Calibration calibration = ip02();
    std::string asked;
    const SignalFlag signal{0};
    const std::vector<Finding> findings = examine_signs_by_hand(
        rig, clock, calibration, 10.0, signal, [&](const std::string& words) { asked += words; });
    ASSERT_EQ(findings.size(), 2u);
    for (const Finding& finding : findings)
      EXPECT_EQ(finding.health, sign == 1 ? Health::good : Health::bad) << finding.subject;
    EXPECT_NE(asked.find("+x"), std::string::npos);
  }
}

TEST(SignsByHand, SayThatNobodyMovedAnything) {
  VirtualClock clock;
  MovedRig rig(clock, [](double) { return EncoderCounts{5, 2048}; });
  const SignalFlag signal{0};
  const std::vector<Finding> findings =
      examine_signs_by_hand(rig, clock, ip02(), 1.0, signal, [](const std::string&) {});
  for (const Finding& finding : findings) EXPECT_EQ(finding.health, Health::not_examined);
  EXPECT_NEAR(static_cast<double>(clock.now_ns()) * 1e-9, 2.0, 0.1);
}

/// A rig with inputs that somebody works as asked: each wish is fulfilled a moment later, but the deaf ones.
class WiredRig final : public Rig {
 public:
  explicit WiredRig(Clock& clock) : clock_(clock) {}
  SafetyInputs inputs{true, 2};
  bool stop_is_deaf = false;
  RigFault active = RigFault::none;
  std::vector<std::string> asked;

  void hear(const std::string& words) {
    asked.push_back(words);
    const bool about_stop = words.find("emergency stop") != std::string::npos;
    if (about_stop && stop_is_deaf) return;
    const bool on = words.rfind("press", 0) == 0 || words.rfind("trip", 0) == 0;
    next_ = !on ? RigFault::none : about_stop ? RigFault::emergency_stop : RigFault::limit_switch;
    from_ns_ = clock_.now_ns() + 500'000'000;
  }
  void open() override {}
  RigReading read() noexcept override {
    if (clock_.now_ns() >= from_ns_) active = next_;
    clock_.sleep_until(clock_.now_ns() + 1'000'000);
    RigReading reading;
    reading.status = active == RigFault::none ? RigStatus::fresh : RigStatus::fault;
    reading.fault = active;
    return reading;
  }
  RigFault write(double) noexcept override {
    ADD_FAILURE() << "a voltage was written";
    return RigFault::none;
  }
  StopReport stop() noexcept override { return at_zero_volts(); }
  SafetyInputs safety_inputs() const noexcept override { return inputs; }

 private:
  Clock& clock_;
  RigFault next_ = RigFault::none;
  std::int64_t from_ns_ = 0;
};

std::vector<Finding> by_hand(WiredRig& rig, Clock& clock) {
  const SignalFlag signal{0};
  return examine_safety_inputs_by_hand(rig, clock, 2.0, signal,
                                       [&rig](const std::string& words) { rig.hear(words); });
}

TEST(SafetyInputs, AreSeenToBePressedAndReleasedByHand) {
  VirtualClock clock;
  WiredRig rig(clock);
  const std::vector<Finding> findings = by_hand(rig, clock);
  ASSERT_EQ(findings.size(), 3u) << "the emergency stop and two limit switches";
  for (const Finding& finding : findings) EXPECT_EQ(finding.health, Health::good) << finding.what;
  EXPECT_EQ(rig.asked.size(), 6u) << "on and off, each";
}

TEST(SafetyInputs, ThatAreNotSeenAreBad) {
  VirtualClock clock;
  WiredRig rig(clock);
  rig.stop_is_deaf = true;
  const std::vector<Finding> findings = by_hand(rig, clock);
  EXPECT_EQ(about(findings, "emergency stop").health, Health::bad);
  EXPECT_NE(about(findings, "emergency stop").remedy.find("gpio.emergency_stop"), std::string::npos);
  EXPECT_EQ(about(findings, "limit switch 2 of 2").health, Health::good);
  EXPECT_EQ(verdict_of(findings), Health::bad);
}

TEST(SafetyInputs, ThatStayActiveAreBad) {
  VirtualClock clock;
  WiredRig rig(clock);
  rig.inputs = {true, 0};
  const SignalFlag signal{0};
  const std::vector<Finding> findings =
      examine_safety_inputs_by_hand(rig, clock, 1.0, signal, [&rig](const std::string& words) {
        if (words.rfind("press", 0) == 0) rig.hear(words);
      });
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].health, Health::bad);
  EXPECT_NE(findings[0].what.find("release"), std::string::npos) << findings[0].what;
}

TEST(SafetyInputs, ArePartOfThePageWithoutAHand) {
  const std::vector<Finding> missing = name_missing_inputs({});
  EXPECT_EQ(about(missing, "emergency stop").what, "no emergency stop is wired");
  EXPECT_FALSE(about(missing, "emergency stop").remedy.empty());
  EXPECT_FALSE(about(missing, "limit switches").remedy.empty());
  EXPECT_TRUE(name_missing_inputs({true, 2}).empty());
  EXPECT_TRUE(judge_safety_inputs({}, {}).empty());
  for (const Finding& finding : judge_safety_inputs({true, 2}, {}))
    EXPECT_EQ(finding.health, Health::not_examined) << finding.subject;
}

TEST(SafetyInputs, ThatAreActiveAreNamedAndNotBlamedOnTheLink) {
  VirtualClock clock;
  WiredRig rig(clock);
  rig.hear("press the emergency stop");
  const SignalFlag signal{0};
  const LinkProbe probe = probe_link(rig, clock, 100.0, 2.0, signal);
  EXPECT_EQ(probe.failed, 0u);
  EXPECT_NEAR(static_cast<double>(probe.emergency_stops), 150.0, 2.0);
  EXPECT_EQ(judge_link(probe, 100.0).health, Health::good);
  EXPECT_EQ(about(judge_safety_inputs(rig.inputs, probe), "emergency stop").health, Health::poor);
  // Pressed all the time, nothing can be said about the link.
  const LinkProbe all = probe_link(rig, clock, 100.0, 1.0, signal);
  EXPECT_EQ(judge_link(all, 100.0).health, Health::not_examined);
}

/// A device that samples on its own time.
class SamplingRig final : public Rig {
 public:
  SamplingRig(Clock& clock, double ppm) : clock_(clock), period_ns_(1e7 * (1.0 + 1e-6 * ppm)) {}
  void open() override {}
  RigReading read() noexcept override {
    RigReading reading;
    reading.status = RigStatus::fresh;
    return reading;
  }
  RigFault write(double) noexcept override { return RigFault::none; }
  StopReport stop() noexcept override { return at_zero_volts(); }
  bool is_clock() const noexcept override { return true; }
  DeviceSample wait_next(std::int64_t until_ns) noexcept override {
    const std::int64_t next_ns = time_ns(waited_for_ + 1);
    clock_.sleep_until(std::min(next_ns, until_ns));
    if (next_ns <= clock_.now_ns()) ++waited_for_;
    return {waited_for_, time_ns(waited_for_)};
  }

 private:
  std::int64_t time_ns(std::uint64_t sample) const {
    return static_cast<std::int64_t>(period_ns_ * static_cast<double>(sample));
  }
  Clock& clock_;
  double period_ns_;
  std::uint64_t waited_for_ = 0;
};

TEST(Link, OfADeviceThatIsTheClockIsHowItSamples) {
  VirtualClock clock;
  SamplingRig rig(clock, 500.0);
  const SignalFlag signal{0};
  LinkProbe probe = probe_link(rig, clock, 100.0, 2.0, signal);
  ASSERT_TRUE(probe.device_clock.has_value());
  EXPECT_NEAR(probe.device_clock->drift_ppm, 500.0, 0.1);
  EXPECT_EQ(probe.device_clock->lost, 0u);
  EXPECT_NEAR(static_cast<double>(probe.counts.size()), 100.0, 2.0) << "of the last second";
  const Finding finding = judge_link(probe, 100.0);
  EXPECT_EQ(finding.health, Health::good);
  EXPECT_NE(finding.what.find("every 10005.00 us (+500 ppm)"), std::string::npos) << finding.what;
  probe.device_clock->lost = 3;
  EXPECT_EQ(judge_link(probe, 100.0).health, Health::poor);
  probe.device_clock->lost = 20;
  EXPECT_EQ(judge_link(probe, 100.0).health, Health::bad);
  probe.device_clock = DeviceTiming{};
  EXPECT_EQ(judge_link(probe, 100.0).health, Health::bad);
}

TEST(DigitalLines, AreReadOrBad) {
  VirtualClock clock;
  WiredRig rig(clock);
  const SignalFlag signal{0};
  LinkProbe probe = probe_link(rig, clock, 100.0, 1.0, signal);
  EXPECT_EQ(judge_lines(probe).health, Health::good);
  EXPECT_EQ(judge_lines(probe).what, "read 100 times");
  probe.failed = 3;
  EXPECT_EQ(judge_lines(probe).health, Health::bad);
  EXPECT_FALSE(judge_lines(probe).remedy.empty());
}

TEST(DigitalLines, ThatAreDrivenAreNamedWithWhatToLookAt) {
  GpioRig gpio;
  gpio.chip = "gpiochip7";
  EXPECT_TRUE(name_driven_lines(gpio).empty());
  gpio.amplifier_enable = DigitalLine{3, true, LineBias::as_is};
  gpio.heartbeat = 4;
  const std::vector<Finding> findings = name_driven_lines(gpio);
  EXPECT_NE(about(findings, "amplifier enable").what.find("line 3 of gpiochip7"), std::string::npos);
  EXPECT_NE(about(findings, "heartbeat").what.find("line 4 of gpiochip7"), std::string::npos);
  for (const Finding& finding : findings) EXPECT_FALSE(finding.remedy.empty());
}

TEST(Histograms, ShowEveryCountWithinAHundredColumns) {
  DurationHistogram narrow, wide, link;
  for (int i = 0; i < 10000; ++i) narrow.add(30'000);
  for (int i = 0; i < 990; ++i) wide.add(70'000 + 100 * i);
  wide.add(9'000'000);
  link.add(20'000'000'000);
  const std::vector<std::string> lines =
      histogram_lines({{"idle", narrow}, {"loaded", wide}, {"link", link}});
  std::uint64_t counted = 0;
  for (const std::string& line : lines) {
    EXPECT_LE(line.size(), 100u) << line;
    std::istringstream words(line.substr(17));
    for (std::string word; words >> word;)
      if (word.find_first_not_of("0123456789") == std::string::npos) counted += std::stoull(word);
  }
  EXPECT_EQ(counted, 10000u + 991u + 1u);
  EXPECT_NE(lines[0].find("loaded"), std::string::npos);
  EXPECT_NE(lines[1].find("20 us to 50 us"), std::string::npos) << lines[1];
  EXPECT_NE(lines.back().find("above 10 s"), std::string::npos) << lines.back();
  const auto late = std::find_if(lines.begin(), lines.end(), [](const std::string& line) {
    return line.find("5 ms to 10 ms") != std::string::npos;
  });
  ASSERT_NE(late, lines.end());
  EXPECT_NE(late->find(" 1 #"), std::string::npos) << "a single one is seen: " << *late;
  EXPECT_TRUE(histogram_lines({{"nothing", DurationHistogram{}}}).empty());
}

TEST(CpuLatencyHold, WritesZeroMicrosecondsWhereItCan) {
  const FakeRoot root;
  root.put("cpu_dma_latency", "");
  const CpuLatencyHold hold(root.path() / "cpu_dma_latency");
  EXPECT_TRUE(hold.held());
  std::ifstream in(root.path() / "cpu_dma_latency", std::ios::binary);
  EXPECT_EQ(std::string((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>()),
            std::string(4, '\0'));
  EXPECT_FALSE(CpuLatencyHold(root.path() / "none").held());
}

}  // namespace
}  // namespace upright
