// The Comedi backend on cards that exist only here: what it asks of them, what it makes of their data, and
// what it refuses. The same on Debian's kernel is in tests/kernel.
#include <gtest/gtest.h>

#include <cerrno>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>

#include "fake_comedi.hpp"
#include "upright/base/error.hpp"
#include "upright/hal/rig_factory.hpp"

namespace upright::test {
namespace {

const std::filesystem::path rigs = std::filesystem::path(UPRIGHT_SOURCE_DIR) / "config" / "rigs";
constexpr double period_s = 0.01;
const std::string device = "/dev/comedi0";

RigFile multiq3_file() {
  return read_rig_file(rigs / "comedi-multiq3.yaml");
}

/// Both encoders on a card of National Instruments, the output on its analog output.
RigFile ni_file() {
  return read_rig_file(rigs / "comedi-ni-pcimio.yaml");
}

std::unique_ptr<Rig> opened(const RigFile& file) {
  auto rig = make_rig(file, {period_s});
  rig->open();
  return rig;
}

std::string refusal(const RigFile& file) {
  try {
    opened(file);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

bool says(const std::string& sentence, const std::string& part) {
  return sentence.find(part) != std::string::npos;
}

class ComediRigTest : public testing::Test {
 protected:
  ComediRigTest() {
    fake_cards().clear();
    fake_cards()[device] = fake_multiq3();
  }
  FakeCard& card(const std::string& name = device) { return fake_cards().at(name); }
  lsampl_t& output() { return card().subdevices[1].data[0]; }
  lsampl_t& counter(std::size_t channel) { return card().subdevices[4].data[channel]; }

  static constexpr lsampl_t zero_volts = 2048;  // the nearest to the middle of 0 to 4095
};

TEST_F(ComediRigTest, BeginsAtZeroVoltsAndCountsFromTheResetValue) {
  counter(0) = 0x800005;
  counter(1) = 0x7ffffd;
  const auto rig = opened(multiq3_file());
  EXPECT_EQ(output(), zero_volts);
  const RigReading reading = rig->read();
  EXPECT_EQ(reading.status, RigStatus::fresh);
  EXPECT_EQ(reading.cart_counts, 5);
  EXPECT_EQ(reading.pendulum_counts, -3);
  EXPECT_GT(rig->read().sequence, reading.sequence);
  EXPECT_EQ(card().lists_read, 2) << "both counters in one call";
  EXPECT_TRUE(card().set_up.empty()) << "the driver has set them up, and they keep their counts";
}

TEST_F(ComediRigTest, PutsOutTheVoltageAtTheMotor) {
  RigFile file = multiq3_file();
  const auto rig = opened(file);
  EXPECT_EQ(rig->write(3.0), RigFault::none);
  EXPECT_EQ(output(), 2457u) << "1 V of -5 to 5: 0.6 times 4095";
  EXPECT_EQ(rig->write(1000.0), RigFault::none);
  EXPECT_EQ(output(), 3413u) << "10 V at the motor are the limit";
  EXPECT_EQ(rig->write(-1000.0), RigFault::none);
  EXPECT_EQ(output(), 683u);
}

TEST_F(ComediRigTest, TurnsTheSignOfTheAmplifier) {
  RigFile file = multiq3_file();
  file.amplifier.sign = -1;
  const auto rig = opened(file);
  rig->write(3.0);
  EXPECT_EQ(output(), 1638u);
}

TEST_F(ComediRigTest, MakesZeroVoltsOfWhatIsNotFinite) {
  const auto rig = opened(multiq3_file());
  constexpr double infinity = std::numeric_limits<double>::infinity();
  for (const double voltage_v : {std::nan(""), infinity, -infinity}) {
    rig->write(6.0);
    EXPECT_EQ(rig->write(voltage_v), RigFault::not_finite);
    EXPECT_EQ(output(), zero_volts);
  }
}

TEST_F(ComediRigTest, StopsForGoodAndLeavesZeroVoltsBehind) {
  auto rig = opened(multiq3_file());
  rig->write(6.0);
  rig->stop();
  EXPECT_EQ(output(), zero_volts);
  rig->write(6.0);
  EXPECT_EQ(output(), zero_volts);
  rig->open();
  rig->write(6.0);
  EXPECT_NE(output(), zero_volts) << "opening again is deliberate";
  rig.reset();
  EXPECT_EQ(output(), zero_volts);
}

TEST_F(ComediRigTest, RefusesASecondController) {
  auto first = opened(multiq3_file());
  first->write(6.0);
  const lsampl_t commanded = output();
  EXPECT_TRUE(says(refusal(multiq3_file()), "already has a controller"));
  EXPECT_EQ(output(), commanded) << "the refused one has touched nothing";
  first.reset();
  EXPECT_EQ(refusal(multiq3_file()), "");
}

TEST_F(ComediRigTest, NamesTheRangesThereAre) {
  fake_cards()[device] = fake_analog();
  RigFile file = multiq3_file();
  file.comedi->output->range = {-4, 4};
  const std::string sentence = refusal(file);
  EXPECT_TRUE(says(sentence, "set range_v to [-10.0, 10.0] or [-5.0, 5.0]")) << sentence;
  EXPECT_TRUE(says(sentence, "comedi-multiq3.yaml:1: comedi.output")) << sentence;
}

TEST_F(ComediRigTest, RefusesWiringTheCardDoesNotHave) {
  RigFile file = multiq3_file();
  file.comedi->output->device = "/dev/comedi7";
  EXPECT_TRUE(says(refusal(file), "load the card's driver"));
  file = multiq3_file();
  file.comedi->output->subdevice = 5;
  EXPECT_TRUE(says(refusal(file), "use subdevice 0 to 4"));
  file.comedi->output->subdevice = 4;
  EXPECT_TRUE(says(refusal(file), "use subdevice 1")) << refusal(file);
  file = multiq3_file();
  file.comedi->pendulum->channel = 4;
  EXPECT_TRUE(says(refusal(file), "use channel 0 to 3"));
  file = multiq3_file();
  file.comedi->cart->subdevice = 0;
  EXPECT_FALSE(refusal(file).empty());
  file = multiq3_file();
  file.calibration.cart.width_bits = 32;
  EXPECT_TRUE(says(refusal(file), "set calibration.cart.width_bits to 24"));
  file = multiq3_file();
  file.comedi->cart->lines = ComediLines{1, 2};
  EXPECT_TRUE(says(refusal(file), "remove lines"));
}

TEST_F(ComediRigTest, RefusesCountersOfUnknownDriversUnlessPlain) {
  card().driver = "somebodys";
  RigFile file = multiq3_file();
  const std::string sentence = refusal(file);
  EXPECT_TRUE(says(sentence, "only for the drivers multiq3, s626, ni_pcimio, ni_660x")) << sentence;
  EXPECT_TRUE(says(sentence, "kind: plain_counter")) << sentence;
  file.comedi->cart->kind = file.comedi->pendulum->kind = ComediEncoderKind::plain_counter;
  counter(0) = 7;
  counter(1) = 0xffffff;
  const RigReading reading = opened(file)->read();
  EXPECT_EQ(reading.cart_counts, 7);
  EXPECT_EQ(reading.pendulum_counts, -1);
}

TEST_F(ComediRigTest, SetsUpACounterOfNationalInstrumentsOnce) {
  fake_cards()[device] = fake_ni_pcimio();
  // The driver of 660x cards refuses this one, having done it.
  card().refused_configurations = {INSN_CONFIG_SET_GATE_SRC};
  const auto rig = opened(ni_file());
  const lsampl_t mode = NI_GPCT_COUNTING_MODE_QUADRATURE_X4_BITS | NI_GPCT_COUNTING_DIRECTION_HW_UP_DOWN_BITS;
  const lsampl_t off = 0x8000;
  const std::vector<GivenInstruction> of_cart = {
      {INSN_CONFIG, 11, 0, {INSN_CONFIG_RESET}},
      {INSN_WRITE, 11, 0, {0}},
      {INSN_WRITE, 11, 1, {0}},
      {INSN_WRITE, 11, 2, {0}},
      {INSN_CONFIG, 11, 0, {INSN_CONFIG_SET_GATE_SRC, 0, off}},
      {INSN_CONFIG, 11, 0, {INSN_CONFIG_SET_GATE_SRC, 1, off}},
      {INSN_CONFIG,
       11,
       0,
       {INSN_CONFIG_SET_OTHER_SRC, NI_GPCT_SOURCE_ENCODER_A, NI_GPCT_PFI_OTHER_SELECT(8)}},
      {INSN_CONFIG,
       11,
       0,
       {INSN_CONFIG_SET_OTHER_SRC, NI_GPCT_SOURCE_ENCODER_B, NI_GPCT_PFI_OTHER_SELECT(10)}},
      {INSN_CONFIG, 11, 0, {INSN_CONFIG_SET_OTHER_SRC, NI_GPCT_SOURCE_ENCODER_Z, off}},
      {INSN_CONFIG, 11, 0, {INSN_CONFIG_SET_COUNTER_MODE, mode}},
      {INSN_CONFIG, 11, 0, {INSN_CONFIG_ARM, 0}},
  };
  ASSERT_EQ(card().set_up.size(), 2 * of_cart.size());
  EXPECT_TRUE(std::equal(of_cart.begin(), of_cart.end(), card().set_up.begin()));
  EXPECT_EQ(card().set_up.back(), (GivenInstruction{INSN_CONFIG, 12, 0, {INSN_CONFIG_ARM, 0}}));
  card().set_up.clear();
  rig->open();
  EXPECT_TRUE(card().set_up.empty()) << "opened again in the same run, the counters go on";
}

TEST_F(ComediRigTest, RefusesACardThatCannotCountInQuadrature) {
  fake_cards()[device] = fake_ni_pcimio();
  card().refused_configurations = {INSN_CONFIG_SET_OTHER_SRC};  // as the E series does
  EXPECT_TRUE(says(refusal(ni_file()), "for quadrature")) << refusal(ni_file());
}

TEST_F(ComediRigTest, RefusesCountsOfAnEarlierStart) {
  fake_cards()[device] = fake_ni_pcimio();
  RigFile file = ni_file();
  file.calibration.zero_at_start = false;
  EXPECT_TRUE(says(refusal(file), "set calibration.zero to {at: start, pose: hanging}"));
  file = ni_file();
  file.comedi->cart->lines.reset();
  EXPECT_TRUE(says(refusal(file), "add lines"));
  file = ni_file();
  file.comedi->cart->channel = 1;
  EXPECT_TRUE(says(refusal(file), "use channel 0"));
}

TEST_F(ComediRigTest, SetsUpTheS626) {
  fake_cards()[device] = fake_s626();
  const auto rig = opened(read_rig_file(rigs / "comedi-s626.yaml"));
  EXPECT_EQ(card().set_up,
            (std::vector<GivenInstruction>{{INSN_CONFIG, 5, 0, {0}}, {INSN_CONFIG, 5, 1, {0}}}));
  card().subdevices[5].data[1] = 0xfffffe;
  EXPECT_EQ(rig->read().pendulum_counts, -2);
}

TEST_F(ComediRigTest, NamesWhatFails) {
  const auto rig = opened(multiq3_file());
  const std::pair<int, RigFault> faults[] = {{ETIMEDOUT, RigFault::link_timeout},
                                             {ENODEV, RigFault::link_lost},
                                             {EIO, RigFault::link_lost},
                                             {EBUSY, RigFault::device_refused}};
  for (const auto& [problem, fault] : faults) {
    card().problem = problem;
    const RigReading reading = rig->read();
    EXPECT_EQ(reading.status, RigStatus::fault) << problem;
    EXPECT_EQ(reading.fault, fault) << problem;
    EXPECT_EQ(rig->write(1.0), fault) << problem;
  }
  card().problem = 0;
  EXPECT_EQ(rig->read().sequence, 1u) << "what failed was no reading";
}

TEST_F(ComediRigTest, DoesNotUseAReadingThatTookMostOfAPeriod) {
  const auto rig = opened(multiq3_file());
  card().takes = std::chrono::milliseconds(9);
  const RigReading reading = rig->read();
  EXPECT_EQ(reading.status, RigStatus::stale);
  EXPECT_EQ(reading.fault, RigFault::link_timeout);
}

TEST_F(ComediRigTest, ReadsAPotentiometer) {
  fake_cards()["/dev/comedi1"] = fake_analog();
  RigFile file = multiq3_file();
  file.comedi->pendulum = {"/dev/comedi1",
                           0,
                           3,
                           ComediEncoderKind::analog_input,
                           std::nullopt,
                           {-5, 5},
                           ComediReference::difference,
                           1000.0};
  const auto rig = opened(file);
  lsampl_t& datum = card("/dev/comedi1").subdevices[0].data[3];
  datum = 0x8000;
  EXPECT_EQ(rig->read().pendulum_counts, 0);
  EXPECT_EQ(card("/dev/comedi1").lists_read, 1);
  datum = 0x8000 + 66;  // 10.1 mV
  EXPECT_EQ(rig->read().pendulum_counts, 10);
  for (const lsampl_t end : {0u, 0xffffu}) {
    datum = end;
    EXPECT_EQ(rig->read().fault, RigFault::out_of_range) << "no contact";
  }
}

TEST_F(ComediRigTest, AsEncodersOnlyRefusesAVoltage) {
  RigFile file = multiq3_file();
  file.output = Backend::modbus_tcp;
  file.comedi->output.reset();
  file.modbus = read_rig_file(rigs / "modbus-tcp.yaml").modbus;
  file.modbus->port = 1;
  output() = 77;
  const auto rig = make_rig(file, {period_s});
  EXPECT_THROW(rig->open(), DeviceError) << "nobody answers at the output's port";
  EXPECT_EQ(output(), 77u);
}

}  // namespace
}  // namespace upright::test
