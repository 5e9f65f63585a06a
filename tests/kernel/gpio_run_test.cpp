// Whole runs over digital lines: the pendulum's counts come as edges, the amplifier obeys its enable line and
// an external watchdog on the heartbeat, and the safety inputs end the run. Cart and voltage travel over
// comedi_test. What the plant was given is what counts.
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <thread>

#include "../../hal/virtual/virtual_plant.hpp"
#include "../integration/virtual_rig_process.hpp"
#include "comedi_card.hpp"
#include "every_millisecond.hpp"
#include "shaft.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/plant_file.hpp"

namespace upright::test {
namespace {

using namespace std::chrono_literals;
using Card = ComediCardUnderTest;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";
constexpr int stop_line = 0, plus_line = 1, minus_line = 2, enable_line = 3, beat_line = 4, a_line = 5,
              b_line = 6;
constexpr double cart_counts_per_v = 2000.0;
const comedi_range ten_v{-10, 10, UNIT_volt};

/// The voltage is channel 0 of the first card, the cart channel 0 of the second.
const std::string rig_text =
    "backend: {cart_encoder: comedi, pendulum_encoder: gpio, output: comedi}\n"
    "calibration:\n"
    "  cart: {m_per_count: 2.27485e-5, sign: 1, width_bits: 32, fastest_mps: 5}\n"
    "  pendulum: {counts_per_revolution: 4096, sign: 1, width_bits: 32, fastest_radps: 60}\n"
    "  zero: {at: counts, cart_counts: 0, pendulum_counts: 0, pose: upright}\n"
    "amplifier: {limit_v: 10, sign: 1}\n"
    "track: {limit_m: 0.39, coast_s: 0.05}\n"
    "fall_angle_rad: 0.6\n"
    "watchdog_s: 0.1\n"
    "comedi:\n"
    "  cart: {kind: analog_input, device: /dev/comedi1, subdevice: 0, channel: 0, range_v: [-10, 10],\n"
    "         counts_per_v: 2000}\n"
    "  output: {device: /dev/comedi0, subdevice: 1, channel: 0, range_v: [-10, 10], amplifier_gain: 1}\n";

const std::string lines_text =
    "gpio:\n"
    "  chip: rig\n"
    "  emergency_stop: {line: 0, active: high}\n"
    "  limit_switches:\n"
    "    - {end: plus_x, line: 1, active: high}\n"
    "    - {end: minus_x, line: 2, active: low}\n"
    "  amplifier_enable: {line: 3, active: high}\n"
    "  heartbeat: {line: 4}\n";

const std::string encoder_text = "  pendulum_encoder: {a: 5, b: 6, fastest_edges_per_s: 4000}\n";

/// Takes the voltage away when the heart does not beat.
class ExternalWatchdog {
 public:
  static constexpr std::int64_t patience_ns = 200'000'000;
  bool alive(bool level, std::int64_t now_ns) {
    if (level != level_) {
      level_ = level;
      beat_ns_ = now_ns;
      ++beats_;
    }
    return now_ns - beat_ns_ < patience_ns;
  }
  int beats() const { return beats_; }

 private:
  bool level_ = false;
  std::int64_t beat_ns_ = -patience_ns;
  std::atomic<int> beats_{0};
};

/// The rig as physics, a thousand times a second, held until the first voltage.
class PlantOnLines {
 public:
  PlantOnLines(const Card& output, const Card& cart, GpioSim& sim, const std::filesystem::path& trace)
      : output_(output),
        cart_(cart),
        sim_(sim),
        shaft_(sim, a_line, b_line),
        plant_(read_rig(YamlMap::from_text(rig_text + lines_text + encoder_text, "rig.yaml")),
               read_plant_file(config + "plants/exponential.yaml"), options(trace)) {
    step(MonotonicClock().now_ns());
    thread_.emplace([this](std::int64_t now_ns) { step(now_ns); });
  }

  /// Turns the encoder by so many counts at once, forth and back, as no pendulum does.
  void rattle(int counts) { rattle_ = counts; }
  int beats() const { return watchdog_.beats(); }

 private:
  /// Line encoders count from where they are: it begins upright, with the cart off the middle.
  static VirtualRigOptions options(const std::filesystem::path& trace) {
    VirtualRigOptions options;
    options.cart0_m = 0.08;
    options.trace = trace;
    return options;
  }

  double motor_v(std::int64_t now_ns) {
    const bool alive = watchdog_.alive(sim_.level(beat_line), now_ns);
    const lsampl_t datum = output_.seen(0);
    comedi_range range = ten_v;
    if (datum == Card::middle || !alive || !sim_.level(enable_line)) return 0.0;
    return comedi_to_phys(datum, &range, Card::top);
  }

  void step(std::int64_t now_ns) {
    plant_.advance_to(now_ns);
    const double voltage_v = motor_v(now_ns);
    if (voltage_v != 0.0) plant_.let_go();
    plant_.feed(1e3);
    plant_.command(voltage_v);
    plant_.trace(false);
    const EncoderCounts counts = plant_.counts();
    comedi_range range = ten_v;
    cart_.put(0, comedi_from_phys(static_cast<double>(counts.cart) / cart_counts_per_v, &range, Card::top));
    shaft_.turn_to(counts.pendulum);
    if (const int rattle = rattle_.exchange(0); rattle != 0) {
      shaft_.turn_to(counts.pendulum + rattle);
      shaft_.turn_to(counts.pendulum);
    }
  }

  const Card& output_;
  const Card& cart_;
  GpioSim& sim_;
  Shaft shaft_;
  VirtualPlant plant_;
  ExternalWatchdog watchdog_;
  std::atomic<int> rattle_{0};
  std::optional<EveryMillisecond> thread_;  // gone before what it moves
};

/// The console is for the tests' own words.
std::vector<std::string> quiet(const std::string& command) {
  return {"sh", "-c", "exec " UPRIGHT_BINARY " " + command + " 2>/dev/null"};
}

class GpioRun : public testing::Test {
 protected:
  GpioRun() {
    sim.pull(minus_line, true);
    std::ofstream(folder / "rig.yaml") << rig_text << lines_text << encoder_text;
    std::ofstream(folder / "gains.yaml") << replaced(text_of(config + "gains/exponential.yaml"),
                                                     "sample_rate_hz: 1000", "sample_rate_hz: 200");
    output.put(0, Card::middle);  // the driver begins a step below
    plant = std::make_unique<PlantOnLines>(output, cart, sim, folder / "trace.csv");
  }

  std::vector<std::string> run_for(const std::string& duration_s) const {
    return quiet("run --rig " + (folder / "rig.yaml").string() + " --gains " +
                 (folder / "gains.yaml").string() + " --out " + (folder / "runs").string() + " --duration " +
                 duration_s);
  }
  /// The plant's record, to its end.
  std::vector<TraceRow> record() {
    plant.reset();
    return read_trace(folder / "trace.csv");
  }
  static double last_voltage_s(const std::vector<TraceRow>& rows) {
    double last_s = 0.0;
    for (const TraceRow& row : rows)
      if (row.voltage_v != 0.0) last_s = row.time_s;
    return last_s;
  }

  GpioSim sim{"rig", 8};
  Card output{"/dev/comedi0"}, cart{"/dev/comedi1"};
  Folder folder;
  std::unique_ptr<PlantOnLines> plant;
};

TEST_F(GpioRun, BalancesOnEdges) {
  Process run(run_for("6"));
  const std::string said = run.rest();
  EXPECT_EQ(run.wait(), 0) << said;
  EXPECT_FALSE(sim.level(enable_line));
  EXPECT_GT(plant->beats(), 900) << "once per voltage, of 1200 periods on a slow machine";
  const std::vector<TraceRow> rows = record();
  const double off_s = last_voltage_s(rows);
  double let_go_s = 0.0, worst_rad = 0.0, worst_later_rad = 0.0;
  for (const TraceRow& row : rows) {
    if (row.held) let_go_s = row.time_s;
    if (row.held || row.time_s > off_s) continue;
    worst_rad = std::max(worst_rad, std::abs(row.theta_rad));
    if (row.time_s > let_go_s + 3.0) worst_later_rad = std::max(worst_later_rad, std::abs(row.theta_rad));
  }
  EXPECT_GT(off_s - let_go_s, 5.0);
  EXPECT_GT(worst_rad, 0.01) << "it had something to do";
  EXPECT_LT(worst_later_rad, 0.05) << said;
}

struct Case {
  const char* name;
  int line;   ///< that is pulled
  bool high;  ///< where to; the line of the encoder: it rattles instead
  const char* cause;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.name;
}

class GpioMishap : public GpioRun, public testing::WithParamInterface<Case> {};

TEST_P(GpioMishap, EndsAtZeroVoltsWithItsCauseNamed) {
  Process run(run_for("60"));
  ASSERT_TRUE(wait_for_rows(folder / "runs"));
  std::this_thread::sleep_for(1s);
  EXPECT_TRUE(sim.level(enable_line));
  const double at_s = monotonic_s();
  if (GetParam().line == a_line)
    plant->rattle(200);
  else
    sim.pull(GetParam().line, GetParam().high);
  const std::string said = run.rest();
  EXPECT_EQ(run.wait(), 3) << said;
  EXPECT_NE(said.find(GetParam().cause), std::string::npos) << said;
  EXPECT_FALSE(sim.level(enable_line));
  EXPECT_EQ(output.seen(0), Card::middle);
  const int beats = plant->beats();
  std::this_thread::sleep_for(200ms);
  EXPECT_EQ(plant->beats(), beats) << "the heart rests";
  const double last_s = last_voltage_s(record());
  EXPECT_GT(last_s, at_s - 0.1) << "it was still balancing";
  EXPECT_LT(last_s, at_s + 0.25);
  RecordProperty("zero_volts_after_ms", static_cast<int>(std::lround(1e3 * (last_s - at_s))));
  std::printf("zero volts after %.0f ms\n", 1e3 * (last_s - at_s));
}

INSTANTIATE_TEST_SUITE_P(
    Lines, GpioMishap,
    testing::Values(Case{"emergency_stop", stop_line, true, "release the emergency stop"},
                    Case{"limit_switch_plus", plus_line, true, "the limit switch at the +x end was hit"},
                    Case{"limit_switch_minus", minus_line, false, "the limit switch at the -x end was hit"},
                    Case{"edges_too_fast", a_line, true, "edges came faster than fastest_edges_per_s"}),
    [](const auto& item) { return std::string(item.param.name); });

/// A card keeps its last voltage; the heartbeat's watchdog takes it away.
TEST_F(GpioRun, KilledItsHeartStopsAndTheExternalWatchdogTakesTheVoltageAway) {
  Process run(run_for("60"));
  ASSERT_TRUE(wait_for_rows(folder / "runs"));
  std::this_thread::sleep_for(500ms);
  run.end(SIGKILL);
  const double at_s = monotonic_s();
  std::this_thread::sleep_for(500ms);
  const double last_s = last_voltage_s(record());
  EXPECT_GT(last_s, at_s - 0.1) << "it was still balancing";
  EXPECT_LT(last_s, at_s + 0.3);
}

TEST_F(GpioRun, ASecondControllerIsRefused) {
  Process run(run_for("60"));
  ASSERT_TRUE(wait_for_rows(folder / "runs"));
  Process second(run_for("1"));
  second.rest();
  EXPECT_EQ(second.wait(), 4);
  EXPECT_EQ(run.end(SIGTERM), 3);
  EXPECT_FALSE(sim.level(enable_line));
}

/// A simulated rig with real lines is a rehearsal.
TEST(GpioRehearsal, TheEmergencyStopEndsARunOfASimulatedRig) {
  GpioSim sim("rig", 8);
  sim.pull(minus_line, true);
  Folder folder;
  std::string rig = text_of(config + "rigs/simulated.yaml") + lines_text;
  std::ofstream(folder / "rig.yaml") << replaced(rig, "../plants", config + "plants");
  std::ofstream(folder / "gains.yaml")
      << replaced(text_of(config + "gains/exponential.yaml"), "sample_rate_hz: 1000", "sample_rate_hz: 100");
  Process run(quiet("run --rig " + (folder / "rig.yaml").string() + " --gains " +
                    (folder / "gains.yaml").string() + " --out " + (folder / "runs").string() +
                    " --duration 60 --theta0-deg 0"));
  ASSERT_TRUE(wait_for_rows(folder / "runs"));
  EXPECT_TRUE(sim.level(enable_line));
  sim.pull(stop_line, true);
  const std::string said = run.rest();
  EXPECT_EQ(run.wait(), 3) << said;
  EXPECT_NE(said.find("release the emergency stop"), std::string::npos) << said;
  EXPECT_FALSE(sim.level(enable_line));
}

}  // namespace
}  // namespace upright::test
