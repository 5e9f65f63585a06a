// The Comedi backend on the kernel's own comedi_test: what is put out, refused and left behind, and whole
// runs that balance a plant through analog channels. Two cards, for a locked output keeps everybody else from
// its neighbours.
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
#include "upright/hal/clock.hpp"
#include "upright/hal/rig_factory.hpp"
#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"

namespace upright::test {
namespace {

using namespace std::chrono_literals;
using Card = ComediCardUnderTest;

const std::string config = UPRIGHT_SOURCE_DIR "/config/";
constexpr double period_s = 0.01;
constexpr double cart_counts_per_v = 2000.0, pendulum_counts_per_v = 400.0;
constexpr double amplifier_gain = 1.5;  // 15 V at the motor are 10 V at the card
const comedi_range ten_v{-10, 10, UNIT_volt};

/// The output is channel 0 of the first card, the encoders are channels 0 and 1 of the second.
std::string rig_text_for(const std::string& output_range = "[-10, 10]", double limit_v = 12.0) {
  return "backend: comedi\n"
         "calibration:\n"
         "  cart: {m_per_count: 2.27485e-5, sign: 1, width_bits: 32, fastest_mps: 5}\n"
         "  pendulum: {counts_per_revolution: 4096, sign: 1, width_bits: 32, fastest_radps: 60}\n"
         "  zero: {at: counts, cart_counts: 0, pendulum_counts: 0, pose: upright}\n"
         "amplifier: {limit_v: " +
         exact_text(limit_v) +
         ", sign: 1}\n"
         "track: {limit_m: 0.39, coast_s: 0.05}\n"
         "fall_angle_rad: 0.6\n"
         "watchdog_s: 0.1\n"
         "comedi:\n"
         "  cart: {kind: analog_input, device: /dev/comedi1, subdevice: 0, channel: 0, range_v: [-10, 10],\n"
         "         counts_per_v: " +
         exact_text(cart_counts_per_v) +
         "}\n"
         "  pendulum: {kind: analog_input, device: /dev/comedi1, subdevice: 0, channel: 1, range_v: [-10, "
         "10],\n"
         "             counts_per_v: " +
         exact_text(pendulum_counts_per_v) +
         "}\n"
         "  output: {device: /dev/comedi0, subdevice: 1, channel: 0, range_v: " +
         output_range + ", amplifier_gain: " + exact_text(amplifier_gain) + "}\n";
}

RigFile rig_of(const std::string& text) {
  return read_rig(YamlMap::from_text(text, "rig.yaml"));
}

/// The data that an analog channel shows for volts.
lsampl_t datum_of(double volts) {
  comedi_range range = ten_v;
  return comedi_from_phys(volts, &range, Card::top);
}

double motor_v(lsampl_t datum) {
  comedi_range range = ten_v;
  return datum == Card::middle ? 0.0 : amplifier_gain * comedi_to_phys(datum, &range, Card::top);
}

class ComediTest : public testing::Test {
 protected:
  std::unique_ptr<Rig> opened(const std::string& text) {
    auto rig = make_rig(rig_of(text), {period_s});
    rig->open();
    return rig;
  }
  std::string refusal(const std::string& text) {
    try {
      opened(text);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  Card output{"/dev/comedi0"}, encoders{"/dev/comedi1"};
};

bool says(const std::string& sentence, const std::string& part) {
  return sentence.find(part) != std::string::npos;
}

TEST_F(ComediTest, PutsOutZeroVoltsAtOpenOnStopAndWhenItGoes) {
  ASSERT_TRUE(output.put(0, 60000));
  auto rig = opened(rig_text_for());
  EXPECT_EQ(output.seen(0), Card::middle);
  EXPECT_EQ(rig->write(3.0), RigFault::none);
  EXPECT_EQ(output.seen(0), datum_of(2.0));
  rig->stop();
  EXPECT_EQ(output.seen(0), Card::middle);
  rig->write(3.0);
  EXPECT_EQ(output.seen(0), Card::middle) << "a stop is for good";
  rig->open();
  rig->write(-3.0);
  EXPECT_EQ(output.seen(0), datum_of(-2.0));
  rig.reset();
  EXPECT_EQ(output.seen(0), Card::middle);
}

TEST_F(ComediTest, MakesZeroVoltsOfWhatIsNotFinite) {
  const auto rig = opened(rig_text_for());
  for (const double voltage_v : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    rig->write(3.0);
    EXPECT_EQ(rig->write(voltage_v), RigFault::not_finite);
    EXPECT_EQ(output.seen(0), Card::middle);
  }
  rig->write(1e6);
  EXPECT_EQ(output.seen(0), datum_of(8.0)) << "the amplifier's limit of 12 V";
}

TEST_F(ComediTest, ReadsPotentiometersAndRefusesTheirEnds) {
  const auto rig = opened(rig_text_for());
  encoders.put(0, datum_of(-1234 / cart_counts_per_v));
  encoders.put(1, datum_of(567 / pendulum_counts_per_v));
  const RigReading reading = rig->read();
  EXPECT_EQ(reading.status, RigStatus::fresh);
  EXPECT_EQ(reading.cart_counts, -1234);
  EXPECT_EQ(reading.pendulum_counts, 567);
  for (const lsampl_t end : {lsampl_t{0}, Card::top}) {
    encoders.put(1, end);
    EXPECT_EQ(rig->read().fault, RigFault::out_of_range);
  }
}

TEST_F(ComediTest, ReadsPlainCountersOfTheWidthTheyHave) {
  const std::string potentiometer =
      "kind: analog_input, device: /dev/comedi1, subdevice: 0, channel: 0, "
      "range_v: [-10, 10],\n         counts_per_v: 2000";
  const std::string text = replaced(rig_text_for(), potentiometer,
                                    "kind: plain_counter, device: /dev/comedi1, subdevice: 0, channel: 0");
  EXPECT_TRUE(says(refusal(text), "give calibration.cart.width_bits 16")) << refusal(text);
  const auto rig = opened(replaced(text, "width_bits: 32", "width_bits: 16"));
  encoders.put(0, 0x7fff);
  encoders.put(1, Card::middle);
  EXPECT_EQ(rig->read().cart_counts, 0x7fff);
  encoders.put(0, 0x8000);
  const RigReading wrapped = rig->read();
  EXPECT_EQ(wrapped.status, RigStatus::fresh) << "a wrap is no jump";
  EXPECT_EQ(wrapped.cart_counts, -0x8000);
}

TEST_F(ComediTest, RefusesWhatTheCardDoesNotOffer) {
  std::string sentence = refusal(rig_text_for("[-9, 9]"));
  EXPECT_TRUE(says(sentence, "give range_v [-10.0, 10.0] or [-5.0, 5.0]: rig.yaml:1: comedi.output"))
      << sentence;
  sentence = refusal(replaced(rig_text_for(), "subdevice: 1", "subdevice: 0"));
  EXPECT_TRUE(says(sentence, "give subdevice 1: ")) << sentence;
  sentence = refusal(replaced(rig_text_for(), "channel: 1", "channel: 8"));
  EXPECT_TRUE(says(sentence, "give channel 0 to 7: ")) << sentence;
  sentence = refusal(replaced(rig_text_for(), "/dev/comedi0", "/dev/comedi3"));
  EXPECT_TRUE(says(sentence, "load the card's driver")) << sentence;
  const std::string potentiometer =
      "kind: analog_input, device: /dev/comedi1, subdevice: 0, channel: 0, "
      "range_v: [-10, 10],\n         counts_per_v: 2000";
  sentence = refusal(replaced(replaced(rig_text_for(), potentiometer,
                                       "kind: counter, device: /dev/comedi1, subdevice: 0, channel: 0"),
                              "width_bits: 32", "width_bits: 16"));
  EXPECT_TRUE(says(sentence, "multiq3, s626, ni_pcimio, ni_660x only")) << sentence;
  EXPECT_TRUE(says(sentence, "driver comedi_test")) << sentence;
}

TEST_F(ComediTest, KeepsOthersAwayWhileItRuns) {
  auto rig = opened(rig_text_for());
  rig->write(3.0);
  EXPECT_TRUE(says(refusal(rig_text_for()), "already has a controller"));
  EXPECT_FALSE(output.put(0, 60000)) << "the kernel refuses it";
  EXPECT_EQ(output.seen(0), datum_of(2.0));
  Folder folder;
  std::ofstream(folder / "rig.yaml") << rig_text_for();
  Process second({UPRIGHT_BINARY, "run", "--rig", folder / "rig.yaml", "--gains",
                  config + "gains/exponential.yaml", "--duration", "1", "--out", folder / "runs"});
  EXPECT_EQ(second.wait(), 4);
  EXPECT_EQ(output.seen(0), datum_of(2.0));
  rig.reset();
  EXPECT_TRUE(output.put(0, Card::middle));
}

/// What happens to an encoder, for good.
enum class Mishap { none, cart_jumps, cart_has_no_contact, cart_sticks, pendulum_sticks, pendulum_turned };

/// The rig as physics: takes the motor's voltage off the first card a thousand times a second, and shows cart
/// and pendulum on the second. Held until the first voltage.
class PlantOnCards {
 public:
  PlantOnCards(const Card& output, const Card& encoders, const std::filesystem::path& trace)
      : output_(output),
        encoders_(encoders),
        plant_(rig_of(rig_text_for()), read_plant_file(config + "plants/exponential.yaml"), options(trace)) {
    step(MonotonicClock().now_ns());
    thread_.emplace([this](std::int64_t now_ns) { step(now_ns); });
  }

  void suffer(Mishap mishap) { mishap_ = mishap; }

 private:
  static VirtualRigOptions options(const std::filesystem::path& trace) {
    VirtualRigOptions options;
    options.theta0_rad = 0.05;
    options.trace = trace;
    return options;
  }

  void step(std::int64_t now_ns) {
    plant_.advance_to(now_ns);
    const double voltage_v = motor_v(output_.seen(0));
    if (voltage_v != 0.0) plant_.let_go();
    plant_.feed(1e3);
    plant_.command(voltage_v);
    plant_.trace(false);
    show(plant_.counts());
  }

  void show(EncoderCounts counts) {
    const Mishap mishap = mishap_;
    if (mishap == Mishap::cart_jumps)
      counts.cart += 15000;  // further than the cart can go while a busy machine misses some periods
    if (mishap == Mishap::pendulum_turned) counts.pendulum = -counts.pendulum;
    const double cart_v = static_cast<double>(counts.cart) / cart_counts_per_v;
    if (mishap != Mishap::cart_sticks)
      encoders_.put(0, mishap == Mishap::cart_has_no_contact ? Card::top : datum_of(cart_v));
    if (mishap == Mishap::pendulum_sticks) return;
    encoders_.put(1, datum_of(static_cast<double>(counts.pendulum) / pendulum_counts_per_v));
  }

  const Card& output_;
  const Card& encoders_;
  VirtualPlant plant_;
  std::atomic<Mishap> mishap_{Mishap::none};
  std::optional<EveryMillisecond> thread_;  // gone before what it moves
};

class ComediRun : public ComediTest {
 protected:
  ComediRun() {
    std::ofstream(folder / "rig.yaml") << rig_text_for();
    std::ofstream(folder / "gains.yaml") << replaced(text_of(config + "gains/exponential.yaml"),
                                                     "sample_rate_hz: 1000", "sample_rate_hz: 200");
    output.put(0, Card::middle);  // the driver begins a step below
    plant = std::make_unique<PlantOnCards>(output, encoders, folder / "trace.csv");
  }

  /// The console is for the tests' own words.
  std::vector<std::string> run_for(const std::string& duration_s) {
    return {"sh", "-c",
            "exec " UPRIGHT_BINARY " run --rig " + (folder / "rig.yaml").string() + " --gains " +
                (folder / "gains.yaml").string() + " --out " + (folder / "runs").string() + " --duration " +
                duration_s + " 2>/dev/null"};
  }
  /// The plant's record, to its end.
  std::vector<TraceRow> record() {
    plant.reset();
    return read_trace(folder / "trace.csv");
  }
  /// How far the pendulum leaned at worst, from this long after it was let go until the end.
  static double worst_theta_rad(const std::vector<TraceRow>& rows, double after_s) {
    double let_go_s = 0.0, worst_rad = 0.0;
    for (const TraceRow& row : rows) {
      if (row.held) let_go_s = row.time_s;
      if (row.time_s > let_go_s + after_s) worst_rad = std::max(worst_rad, std::abs(row.theta_rad));
    }
    return worst_rad;
  }

  Folder folder;
  std::unique_ptr<PlantOnCards> plant;
};

TEST_F(ComediRun, BalancesThroughAnalogChannels) {
  Process run(run_for("6"));
  const std::string said = run.rest();
  EXPECT_EQ(run.wait(), 0) << said;
  EXPECT_EQ(output.seen(0), Card::middle);
  std::vector<TraceRow> rows = record();
  ASSERT_FALSE(rows.empty());
  EXPECT_FALSE(rows.back().held);
  EXPECT_EQ(rows.back().voltage_v, 0.0);
  while (!rows.empty() && rows.back().voltage_v == 0.0) rows.pop_back();
  ASSERT_FALSE(rows.empty());
  EXPECT_GT(rows.back().time_s - rows.front().time_s, 5.0);
  EXPECT_LT(worst_theta_rad(rows, 2.0), 0.05) << said;
}

struct Case {
  const char* name;
  Mishap mishap;
  const char* cause;  ///< a part of the sentence
  double within_s;    ///< from the mishap to zero volts
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.name;
}

class ComediMishap : public ComediRun, public testing::WithParamInterface<Case> {};

TEST_P(ComediMishap, EndsAtZeroVoltsWithItsCauseNamed) {
  Process run(run_for("60"));
  ASSERT_TRUE(wait_for_rows(folder / "runs"));
  std::this_thread::sleep_for(1s);
  const double at_s = monotonic_s();
  plant->suffer(GetParam().mishap);
  const std::string said = run.rest();
  EXPECT_EQ(run.wait(), 3) << said;
  EXPECT_TRUE(says(said, GetParam().cause)) << said;
  EXPECT_EQ(output.seen(0), Card::middle);
  double last_voltage_s = 0.0;
  for (const TraceRow& row : record())
    if (row.voltage_v != 0.0) last_voltage_s = row.time_s;
  EXPECT_GT(last_voltage_s, at_s - 0.1) << "it was still balancing";
  EXPECT_LT(last_voltage_s, at_s + GetParam().within_s);
}

INSTANTIATE_TEST_SUITE_P(
    Encoders, ComediMishap,
    testing::Values(Case{"cart_jumps", Mishap::cart_jumps, "the counts jumped", 0.1},
                    Case{"cart_has_no_contact", Mishap::cart_has_no_contact,
                         "counts the hardware cannot mean", 0.25},
                    Case{"cart_sticks", Mishap::cart_sticks, "check the cart's encoder", 1.5},
                    Case{"pendulum_sticks", Mishap::pendulum_sticks, "check the pendulum's encoder", 1.5}),
    [](const auto& item) { return std::string(item.param.name); });

TEST_F(ComediRun, AWrongSignIsCaughtBeforeTheEndOfTheTrack) {
  plant->suffer(Mishap::pendulum_turned);
  Process run(run_for("10"));
  const std::string said = run.rest();
  EXPECT_EQ(run.wait(), 3) << said;
  EXPECT_TRUE(says(said, "check the signs of encoders and amplifier")) << said;
  EXPECT_EQ(output.seen(0), Card::middle);
  constexpr double end_of_track_m = 0.407;
  double furthest_m = 0.0, last_voltage_s = 0.0, at_s = 0.0;
  for (const TraceRow& row : record()) {
    if (row.held) at_s = row.time_s;
    if (row.voltage_v != 0.0) last_voltage_s = row.time_s;
    if (row.time_s < last_voltage_s + 0.1) furthest_m = std::max(furthest_m, std::abs(row.cart_m));
  }
  EXPECT_GT(last_voltage_s, at_s);
  EXPECT_LT(furthest_m, end_of_track_m);
}

TEST_F(ComediRun, LeavesZeroVoltsBehindWhenTerminated) {
  Process run(run_for("60"));
  ASSERT_TRUE(wait_for_rows(folder / "runs"));
  EXPECT_EQ(run.end(SIGTERM), 3);
  EXPECT_EQ(output.seen(0), Card::middle);
}

/// What the documentation says: a card has no watchdog of its own.
TEST_F(ComediRun, KilledLeavesTheLastVoltageUntilTheNextStart) {
  Process run(run_for("60"));
  ASSERT_TRUE(wait_for_rows(folder / "runs"));
  while (output.seen(0) == Card::middle) std::this_thread::sleep_for(1ms);
  run.end(SIGKILL);
  const lsampl_t left = output.seen(0);
  EXPECT_NE(left, Card::middle);
  std::this_thread::sleep_for(300ms);
  EXPECT_EQ(output.seen(0), left);
  const auto rig = opened(rig_text_for());
  EXPECT_EQ(output.seen(0), Card::middle)
      << "the lock went with the process, and opening puts out zero volts";
}

}  // namespace
}  // namespace upright::test
