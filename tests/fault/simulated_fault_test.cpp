// The fault suite on the simulated rig, in virtual and in real time. The faults come between the loop and the
// plant, whose own input is the record.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <fstream>
#include <functional>
#include <memory>
#include <numbers>

#include "../integration/virtual_rig_process.hpp"
#include "broken_compensator.hpp"
#include "evidence.hpp"
#include "hal/guarded_rig.hpp"
#include "shim.hpp"
#include "upright/hal/simulated_rig.hpp"
#include "upright/model/plant_file.hpp"
#include "upright/runtime/session.hpp"

namespace upright::test {
namespace {

constexpr double rate_hz = 500.0;
constexpr double period_s = 1.0 / rate_hz;
constexpr int bad = 250;  // the cycle in which most faults begin

double seconds(std::int64_t time_ns) {
  return static_cast<double>(time_ns) * 1e-9;
}

/// The last thing before the plant: what it was given, and where it was.
class RecordedRig final : public Rig {
 public:
  RecordedRig(std::unique_ptr<Rig> rig, Clock& clock, const Calibration& calibration)
      : rig_(std::move(rig)), clock_(clock), scaler_(calibration) {
    constexpr std::size_t max_rows = 20000;
    rows_.reserve(max_rows);
  }
  void open() override { rig_->open(); }
  RigReading read() noexcept override {
    const RigReading reading = rig_->read();
    cart_m_ = scaler_.scale(reading.cart_counts, reading.pendulum_counts).cart_m;
    note();
    return reading;
  }
  RigFault write(double voltage_v) noexcept override {
    voltage_v_ = voltage_v;
    note();
    return rig_->write(voltage_v);
  }
  StopReport stop() noexcept override {
    voltage_v_ = 0.0;
    note();
    return rig_->stop();
  }
  const std::vector<PlantRow>& rows() const { return rows_; }

 private:
  void note() noexcept {
    if (rows_.size() < rows_.capacity()) rows_.push_back({seconds(clock_.now_ns()), voltage_v_, cart_m_});
  }

  std::unique_ptr<Rig> rig_;
  Clock& clock_;
  PoseScaler scaler_;
  std::vector<PlantRow> rows_;
  double voltage_v_ = 0.0, cart_m_ = 0.0;
};

/// What surrounds a run, for faults that are not in its readings.
struct Surroundings {
  Clock& clock;
  SignalFlag& signal;
};

/// Called in each cycle, before the controller sees the reading.
using Tamper = std::function<void(int cycle, RigReading& reading, Surroundings& around)>;

enum class Begins { in_cycle, at_the_start, when_the_shim_strikes, when_the_log_ends };

struct Case {
  const char* fault = "";
  Expectation expectation;
  Tamper tamper = {};
  Begins begins = Begins::in_cycle;
  int first = bad;  ///< the cycle in which it begins
  double duration_s = 1.5;
  bool real_time_only = false;
  bool broken_controller = false;
  double output_sign = 1.0;
  std::function<void(RigFile&)> rig = {};          ///< the rig, plant and controller alike
  std::function<void(RigFile&)> rig_as_read = {};  ///< what the controller takes it for
  std::function<void()> before = {}, after = {};
};

class TamperedRig final : public Rig {
 public:
  TamperedRig(std::unique_ptr<RecordedRig> plant, const Surroundings& around, const Case& what)
      : plant_(std::move(plant)),
        around_(around),
        tamper_(what.tamper),
        first_(what.first),
        sign_(what.output_sign) {}
  void open() override { plant_->open(); }
  RigReading read() noexcept override {
    RigReading reading = plant_->read();
    if (cycle_ == first_) bad_s_ = seconds(around_.clock.now_ns());
    if (tamper_) tamper_(cycle_, reading, around_);
    ++cycle_;
    return reading;
  }
  RigFault write(double voltage_v) noexcept override { return plant_->write(sign_ * voltage_v); }
  StopReport stop() noexcept override { return plant_->stop(); }
  const RecordedRig& plant() const { return *plant_; }
  double bad_s() const { return bad_s_; }

 private:
  std::unique_ptr<RecordedRig> plant_;
  Surroundings around_;
  Tamper tamper_;
  int first_;
  double sign_;
  int cycle_ = 0;
  double bad_s_ = 0.0;
};

Tamper every(int nth, RigStatus status, RigFault fault) {
  return [=](int cycle, RigReading& reading, Surroundings&) {
    if (cycle < bad || cycle % nth != 0) return;
    reading.status = status;
    reading.fault = fault;
  };
}

Tamper at_once(std::function<void(Surroundings&)> action) {
  return [action = std::move(action)](int cycle, RigReading&, Surroundings& around) {
    if (cycle == bad) action(around);
  };
}

Tamper standing_still(double for_s) {
  return at_once([for_s](Surroundings& around) {
    around.clock.sleep_until(around.clock.now_ns() + static_cast<std::int64_t>(1e9 * for_s));
  });
}

Tamper stuck(std::int64_t RigReading::*counts, int first = bad) {
  return [counts, first, last = std::int64_t{0}](int cycle, RigReading& reading, Surroundings&) mutable {
    if (cycle <= first) last = reading.*counts;
    reading.*counts = last;
  };
}

Tamper old_counts_once_more(int nth) {
  return [nth, last = RigReading{}](int cycle, RigReading& reading, Surroundings&) mutable {
    const RigReading now = reading;
    if (cycle >= bad && cycle % nth == 0) {
      reading.cart_counts = last.cart_counts;
      reading.pendulum_counts = last.pendulum_counts;
    }
    last = now;
  };
}

void set_limit(__rlimit_resource resource, rlim_t limit) {
  rlimit limits{};
  getrlimit(resource, &limits);
  limits.rlim_cur = std::min(limit, limits.rlim_max);
  setrlimit(resource, &limits);
}

rlim_t address_space_in_use() {
  std::ifstream in("/proc/self/statm");
  rlim_t pages = 0;
  in >> pages;
  return pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

std::vector<Case> link_cases() {
  constexpr double watchdog_s = 0.1;
  constexpr int nth = 20;
  return {
      {.fault = "late",
       .expectation = goes_on(),
       .tamper = every(nth, RigStatus::stale, RigFault::link_timeout)},
      {.fault = "drop",
       .expectation = goes_on(),
       .tamper = every(nth, RigStatus::fault, RigFault::link_timeout)},
      {.fault = "corrupt",
       .expectation = goes_on(),
       .tamper = every(nth, RigStatus::fault, RigFault::corrupt_reply)},
      {.fault = "stale", .expectation = goes_on(), .tamper = old_counts_once_more(nth)},
      {.fault = "silent",
       .expectation = stops({"link_lost"}, watchdog_s + period_s),
       .tamper = every(1, RigStatus::fault, RigFault::link_timeout)},
      {.fault = "always_late",
       .expectation = stops({"stale_encoder"}, watchdog_s + period_s),
       .tamper = every(1, RigStatus::stale, RigFault::link_timeout)},
      {.fault = "cut",
       .expectation = stops({"link_lost"}, watchdog_s + period_s),
       .tamper = every(1, RigStatus::fault, RigFault::link_lost)},
      {.fault = "restart",
       .expectation = stops({"rig_fault"}, period_s),
       .tamper = every(1, RigStatus::fault, RigFault::device_restarted)},
      {.fault = "no_contact",
       .expectation = stops({"link_lost"}, watchdog_s + period_s),
       .tamper = every(1, RigStatus::fault, RigFault::out_of_range)},
      {.fault = "emergency_stop",
       .expectation = stops({"emergency_stop"}, period_s),
       .tamper = every(1, RigStatus::fault, RigFault::emergency_stop)},
      {.fault = "limit_switch",
       .expectation = stops({"track_limit"}, period_s),
       .tamper = every(1, RigStatus::fault, RigFault::limit_switch)},
      {.fault = "line_failed",
       .expectation = stops({"rig_fault"}, period_s),
       .tamper = every(1, RigStatus::fault, RigFault::line_failed)},
      {.fault = "edges_lost",
       .expectation = stops({"rig_fault"}, period_s),
       .tamper = every(1, RigStatus::fault, RigFault::edges_lost)},
      {.fault = "edges_too_fast",
       .expectation = stops({"rig_fault"}, period_s),
       .tamper = every(1, RigStatus::fault, RigFault::edges_too_fast)},
  };
}

std::vector<Case> encoder_cases() {
  const Expectation runaway = stops({"fell", "track_limit"}, 1.5);
  return {
      {.fault = "stuck_cart",
       .expectation = stops({"stuck_encoder"}, stuck_noticed_s),
       .tamper = stuck(&RigReading::cart_counts),
       .duration_s = 4.0},
      {.fault = "stuck_pendulum",
       .expectation = stops({"stuck_encoder"}, stuck_noticed_s),
       .tamper = stuck(&RigReading::pendulum_counts),
       .duration_s = 4.0},
      {.fault = "jump",
       .expectation = stops({"rig_fault"}, 3 * period_s),
       .tamper =
           [](int cycle, RigReading& reading, Surroundings&) {
             if (cycle >= bad) reading.cart_counts += 5000;
           }},
      {.fault = "wrap",
       .expectation = goes_on(),
       .rig =
           [](RigFile& rig) {
             rig.calibration.cart.width_bits = rig.calibration.pendulum.width_bits = 16;
             rig.calibration.cart_zero_counts = 32760;
             rig.calibration.pendulum_zero_counts = -32768;
           }},
      {.fault = "sign_amplifier",
       .expectation = runaway,
       .begins = Begins::at_the_start,
       .output_sign = -1.0},
      {.fault = "sign_cart",
       .expectation = runaway,
       .begins = Begins::at_the_start,
       .rig_as_read = [](RigFile& rig) { rig.calibration.cart.sign *= -1; }},
      {.fault = "sign_pendulum",
       .expectation = runaway,
       .begins = Begins::at_the_start,
       .rig_as_read = [](RigFile& rig) { rig.calibration.pendulum.sign *= -1; }},
  };
}

std::vector<Case> machine_cases() {
  constexpr double log_patience_s = 2.0, round_s = 0.05;
  constexpr double long_enough_s = 4.0;
  const auto disturbing = [](Disturbance kind, double amount) {
    return [kind, amount] { disturb(kind, 0.5, amount); };
  };
  const auto quiet = [] { disturb(Disturbance::none, 0.0, 0.0); };
  return {
      {.fault = "missed_cycles", .expectation = goes_on(), .tamper = standing_still(short_standstill_s)},
      // Nothing takes the voltage from the simulated motor while the program stands still.
      {.fault = "overrun",
       .expectation = stops({"overrun"}, 0.25 + 2 * period_s),
       .tamper = standing_still(0.25)},
      {.fault = "nan", .expectation = stops({"not_finite"}, period_s), .broken_controller = true},
      {.fault = "sigterm",
       .expectation = stops({"signal"}, period_s),
       .tamper = at_once([](Surroundings& around) { around.signal = SIGTERM; })},
      {.fault = "disk_full",
       .expectation = stops({"log_failed"}, round_s),
       .begins = Begins::when_the_log_ends,
       .real_time_only = true,
       .before =
           [] {
             std::signal(SIGXFSZ, SIG_IGN);
             set_limit(RLIMIT_FSIZE, 80'000);
           },
       .after = [] { set_limit(RLIMIT_FSIZE, RLIM_INFINITY); }},
      {.fault = "slow_disk",
       .expectation = goes_on(),
       .real_time_only = true,
       .before = disturbing(Disturbance::slow_writes, 0.3),
       .after = quiet},
      {.fault = "dead_disk",
       .expectation = stops({"log_failed"}, log_patience_s + round_s),
       .begins = Begins::when_the_shim_strikes,
       .duration_s = long_enough_s,
       .real_time_only = true,
       .before = disturbing(Disturbance::one_slow_write, 3.0),
       .after = quiet},
      {.fault = "writer_killed",
       .expectation = stops({"log_failed"}, log_patience_s + round_s),
       .begins = Begins::when_the_shim_strikes,
       .duration_s = long_enough_s,
       .real_time_only = true,
       .before = disturbing(Disturbance::kill_writer, 0.0),
       .after = quiet},
      {.fault = "clock_step",
       .expectation = goes_on(),
       .real_time_only = true,
       .before = disturbing(Disturbance::step_clock, 3600.0),
       .after = quiet},
      {.fault = "memory",
       .expectation = goes_on(),
       .tamper = at_once([](Surroundings&) { set_limit(RLIMIT_AS, address_space_in_use()); }),
       .real_time_only = true,
       .after = [] { set_limit(RLIMIT_AS, RLIM_INFINITY); }},
  };
}

struct On {
  Case what;
  bool fast;
};

void PrintTo(const On& on, std::ostream* out) {
  *out << on.what.fault << (on.fast ? " in virtual time" : " in real time");
}

std::vector<On> all() {
  std::vector<On> list;
  for (const std::vector<Case>& cases : {link_cases(), encoder_cases(), machine_cases()})
    for (const Case& c : cases)
      for (const bool fast : {true, false})
        if (!fast || !c.real_time_only) list.push_back({c, fast});
  return list;
}

RunSetup setup_for(const Case& c, bool fast) {
  RunSetup setup;
  setup.command = "simulated_fault_test";
  setup.label = c.fault;
  setup.duration_s = c.duration_s;
  setup.fast = fast;
  setup.seed = 1;
  setup.theta0_rad = 3.0 * std::numbers::pi / 180.0;
  setup.control = read_gain_file(UPRIGHT_SOURCE_DIR "/config/gains/exponential.yaml");
  setup.control.sample_rate_hz = rate_hz;
  setup.rig = read_rig_file(UPRIGHT_SOURCE_DIR "/config/rigs/simulated.yaml");
  setup.rig.simulated->plant = UPRIGHT_SOURCE_DIR "/config/plants/exponential.yaml";
  if (c.rig) c.rig(setup.rig);
  setup.limits = {static_cast<std::uint64_t>(std::llround(c.duration_s * rate_hz)),
                  setup.rig.track_limit_m,
                  setup.rig.fall_angle_rad,
                  setup.rig.watchdog_s,
                  default_periods_late(setup.control.period_s()),
                  setup.rig.coast_s};
  setup.limits.encoders = rig_limits(setup.rig, read_plant_file(setup.rig.simulated->plant)).encoders;
  return setup;
}

double begin_of(const Case& c, const TamperedRig& rig, const std::filesystem::path& run) {
  switch (c.begins) {
    case Begins::in_cycle:
      return rig.bad_s();
    case Begins::at_the_start:
      break;
    case Begins::when_the_shim_strikes:
      return struck_s();
    case Begins::when_the_log_ends:
      return log_end_s(run);
  }
  return rig.plant().rows().front().time_s;
}

std::optional<Evidence> evidence_of(const On& on, const Folder& folder) {
  const Case& c = on.what;
  MonotonicClock real_clock;
  VirtualClock virtual_clock;
  Clock& clock = on.fast ? static_cast<Clock&>(virtual_clock) : real_clock;
  SignalFlag signal{0};
  RunSetup setup = setup_for(c, on.fast);
  auto recorded = std::make_unique<RecordedRig>(
      make_simulated_rig(setup.rig, clock, {setup.seed, setup.theta0_rad}), clock, setup.rig.calibration);
  auto tampered = std::make_unique<TamperedRig>(std::move(recorded), Surroundings{clock, signal}, c);
  const TamperedRig& watched = *tampered;
  const std::unique_ptr<Rig> rig = guarded(std::move(tampered), setup.rig.calibration);
  if (c.rig_as_read) c.rig_as_read(setup.rig);
  rig->open();
  SessionOptions options;
  options.out = folder / "runs";
  std::atomic<double> broken_since_s{0.0};
  if (c.broken_controller) options.parts = std::make_unique<BrokenCompensator>(bad, broken_since_s);
  if (c.before) c.before();
  const SessionResult result = run_session(setup, *rig, clock, signal, std::move(options));
  const bool never_struck = c.begins == Begins::when_the_shim_strikes && struck_s() == 0.0;
  Evidence evidence;
  evidence.run = result.directory;
  // The controller says the time of a real clock only.
  const bool breaks = c.broken_controller && !on.fast;
  evidence.fault_s = breaks ? broken_since_s.load() : begin_of(c, watched, result.directory);
  if (c.after) c.after();
  if (never_struck) return std::nullopt;
  evidence.plant = watched.plant().rows();
  evidence.replays = !c.broken_controller;
  evidence.log_may_end = c.begins == Begins::when_the_log_ends;
  return evidence;
}

class SimulatedFault : public testing::TestWithParam<On> {};

TEST_P(SimulatedFault, HasItsOutcome) {
  const On& on = GetParam();
  const Expectation& expectation = on.what.expectation;
  const auto attempt = [&] {
    const Folder folder;
    const auto evidence = came_about(folder / "runs", [&] { return evidence_of(on, folder); });
    if (evidence) judge(*evidence, expectation);
  };
  if (!on.fast) {
    fault_case(on.what.fault, Bench::simulated_real_time, cell_of(expectation), attempt);
    return;
  }
  attempt();
  if (!HasFailure()) record(on.what.fault, Bench::simulated_fast, cell_of(expectation));
}

/// Where the rig is nearly at rest, an encoder that sticks shows what is true for a while yet.
TEST(StuckEncoder, IsNoticedInTimeWhereverItSticks) {
  for (const auto counts : {&RigReading::cart_counts, &RigReading::pendulum_counts})
    for (int first = 20; first < 1500; first += 37) {
      const Expectation expectation = stops({"stuck_encoder"}, stuck_noticed_s);
      const Case sticks{.fault = "stuck",
                        .expectation = expectation,
                        .tamper = stuck(counts, first),
                        .first = first,
                        .duration_s = 8.0};
      const Folder folder;
      judge(evidence_of({sticks, true}, folder).value(), expectation);
      ASSERT_FALSE(HasFailure()) << (counts == &RigReading::cart_counts ? "cart" : "pendulum") << " in cycle "
                                 << first;
    }
}

INSTANTIATE_TEST_SUITE_P(, SimulatedFault, testing::ValuesIn(all()), [](const auto& item) {
  return std::string(item.param.what.fault) + (item.param.fast ? "_fast" : "_real_time");
});

}  // namespace
}  // namespace upright::test
