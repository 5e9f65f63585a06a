// The Comedi backend on the kernel's comedi_test driver: what it puts out, reads and refuses, and a run
// through analog channels.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "balance.hpp"
#include "card_wires.hpp"
#include "guest_run.hpp"
#include "plant_on_wires.hpp"
#include "upright/base/error.hpp"
#include "upright/hal/rig_factory.hpp"

namespace upright::test {
namespace {

using Card = ComediCardUnderTest;

constexpr double period_s = 0.01;
constexpr double cart_counts_per_v = CardScales::cart_counts_per_v;
constexpr double pendulum_counts_per_v = CardScales::pendulum_counts_per_v;

RigFile rig_of(const std::string& text) {
  return read_rig(YamlMap::from_text(text, "rig.yaml"));
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
  auto rig = opened(card_rig_text());
  EXPECT_EQ(output.seen(0), Card::middle);
  EXPECT_EQ(rig->write(3.0), RigFault::none);
  EXPECT_EQ(output.seen(0), Card::datum_of(2.0));
  rig->stop();
  EXPECT_EQ(output.seen(0), Card::middle);
  rig->write(3.0);
  EXPECT_EQ(output.seen(0), Card::middle) << "a stop is for good";
  rig->open();
  rig->write(-3.0);
  EXPECT_EQ(output.seen(0), Card::datum_of(-2.0));
  rig.reset();
  EXPECT_EQ(output.seen(0), Card::middle);
}

TEST_F(ComediTest, MakesZeroVoltsOfWhatIsNotFinite) {
  const auto rig = opened(card_rig_text());
  for (const double voltage_v : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    rig->write(3.0);
    EXPECT_EQ(rig->write(voltage_v), RigFault::not_finite);
    EXPECT_EQ(output.seen(0), Card::middle);
  }
  rig->write(1e6);
  EXPECT_EQ(output.seen(0), Card::datum_of(8.0)) << "the amplifier's limit of 12 V";
}

TEST_F(ComediTest, ReadsPotentiometersAndRefusesTheirEnds) {
  const auto rig = opened(card_rig_text());
  encoders.put(0, Card::datum_of(-1234 / cart_counts_per_v));
  encoders.put(1, Card::datum_of(567 / pendulum_counts_per_v));
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
  const std::string text = replaced(card_rig_text(), potentiometer,
                                    "kind: plain_counter, device: /dev/comedi1, subdevice: 0, channel: 0");
  EXPECT_TRUE(says(refusal(text), "set calibration.cart.width_bits to 16")) << refusal(text);
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
  std::string sentence = refusal(card_rig_text("[-9, 9]"));
  EXPECT_TRUE(says(sentence, "set range_v to [-10.0, 10.0] or [-5.0, 5.0]")) << sentence;
  EXPECT_TRUE(says(sentence, "rig.yaml:1: comedi.output")) << sentence;
  sentence = refusal(replaced(card_rig_text(), "subdevice: 1", "subdevice: 0"));
  EXPECT_TRUE(says(sentence, "use subdevice 1")) << sentence;
  sentence = refusal(replaced(card_rig_text(), "channel: 1", "channel: 8"));
  EXPECT_TRUE(says(sentence, "use channel 0 to 7")) << sentence;
  sentence = refusal(replaced(card_rig_text(), "/dev/comedi0", "/dev/comedi3"));
  EXPECT_TRUE(says(sentence, "load the card's driver")) << sentence;
  const std::string potentiometer =
      "kind: analog_input, device: /dev/comedi1, subdevice: 0, channel: 0, "
      "range_v: [-10, 10],\n         counts_per_v: 2000";
  sentence = refusal(replaced(replaced(card_rig_text(), potentiometer,
                                       "kind: counter, device: /dev/comedi1, subdevice: 0, channel: 0"),
                              "width_bits: 32", "width_bits: 16"));
  EXPECT_TRUE(says(sentence, "only for the drivers multiq3, s626, ni_pcimio, ni_660x")) << sentence;
  EXPECT_TRUE(says(sentence, "driver comedi_test")) << sentence;
}

TEST_F(ComediTest, KeepsOthersAwayWhileItRuns) {
  auto rig = opened(card_rig_text());
  rig->write(3.0);
  EXPECT_TRUE(says(refusal(card_rig_text()), "already has a controller"));
  EXPECT_FALSE(output.put(0, 60000)) << "the kernel refuses it";
  EXPECT_EQ(output.seen(0), Card::datum_of(2.0));
  const GuestRun files(card_rig_text());
  Process second(files.command(1.0));
  EXPECT_EQ(second.wait(), 4);
  EXPECT_EQ(output.seen(0), Card::datum_of(2.0));
  rig.reset();
  EXPECT_TRUE(output.put(0, Card::middle));
}

TEST(ComediRun, BalancesThroughAnalogChannels) {
  const GuestRun files(card_rig_text());
  CardWires wires(CardWires::Encoders::potentiometers);
  PlantOnWires plant(wires, card_rig_text(), card_rig_start, files.trace());
  Process run(files.command(6.0));
  const std::string said = run.rest();
  EXPECT_EQ(run.wait(), 0) << said;
  EXPECT_TRUE(wires.at_rest());
  const std::vector<TraceRow> rows = plant.record();
  ASSERT_FALSE(rows.empty());
  EXPECT_EQ(rows.back().voltage_v, 0.0);
  EXPECT_GT(last_voltage_s(rows) - let_go_s(rows), 5.0);
  EXPECT_LT(worst_theta_rad(rows, 2.0), 0.05) << said;
}

}  // namespace
}  // namespace upright::test
