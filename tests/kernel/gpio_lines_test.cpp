// The digital lines around a rig, on the kernel's simulated chip.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "gpio_sim.hpp"
#include "hal/gpio_rig.hpp"
#include "upright/base/error.hpp"

namespace upright::test {
namespace {

constexpr int stop_line = 0, plus_line = 1, minus_line = 2, enable_line = 3, beat_line = 4;

/// What the rig behind the lines was told, and what it says.
struct Behind {
  std::vector<double> written;
  bool stopped = false;
  bool opens = true;
  RigFault read_fault = RigFault::none;
  RigFault write_fault = RigFault::none;
};

class RigBehind final : public Rig {
 public:
  explicit RigBehind(Behind& behind) : behind_(behind) {}
  void open() override {
    if (!behind_.opens) throw DeviceError("no device");
    behind_.stopped = false;
  }
  RigReading read() noexcept override {
    RigReading reading;
    reading.fault = behind_.read_fault;
    reading.status = behind_.read_fault == RigFault::none ? RigStatus::fresh : RigStatus::fault;
    reading.cart_counts = 7;
    return reading;
  }
  RigFault write(double voltage_v) noexcept override {
    behind_.written.push_back(voltage_v);
    return behind_.write_fault;
  }
  StopReport stop() noexcept override {
    behind_.stopped = true;
    return at_zero_volts();
  }

 private:
  Behind& behind_;
};

class GpioLines : public ::testing::Test {
 protected:
  GpioLines() {
    file.file = "rig.yaml";
    file.gpio.emplace();
    file.gpio->chip = sim.chip();
    // The stop is normally closed to ground, the switches are normally open to the supply.
    file.gpio->emergency_stop = DigitalLine{stop_line, true, LineBias::pull_up};
    file.gpio->limit_switches = {{TrackEnd::plus_x, {plus_line, true, LineBias::as_is}},
                                 {TrackEnd::minus_x, {minus_line, false, LineBias::as_is}}};
    file.gpio->amplifier_enable = DigitalLine{enable_line, true, LineBias::as_is};
    file.gpio->heartbeat = beat_line;
  }
  std::unique_ptr<Rig> made() { return with_gpio_lines(std::make_unique<RigBehind>(behind), file); }
  /// Open, with nothing pressed.
  std::unique_ptr<Rig> opened() {
    auto rig = made();
    rig->open();
    sim.pull(stop_line, false);
    sim.pull(plus_line, false);
    sim.pull(minus_line, true);
    return rig;
  }

  GpioSim sim{"lines", 8};
  RigFile file;
  Behind behind;
};

TEST_F(GpioLines, LetAReadingThroughWhileNothingIsPressed) {
  const auto rig = opened();
  const RigReading reading = rig->read();
  EXPECT_EQ(reading.status, RigStatus::fresh);
  EXPECT_EQ(reading.cart_counts, 7);
  EXPECT_TRUE(rig->safety_inputs().emergency_stop);
  EXPECT_EQ(rig->safety_inputs().limit_switches, 2);
}

TEST_F(GpioLines, EachInputIsItsOwnFaultAtItsOwnLevelWhileItIsActive) {
  struct Case {
    int line;
    bool pressed_high;
    RigFault fault;
  };
  const auto rig = opened();
  for (const Case& c : {Case{stop_line, true, RigFault::emergency_stop},
                        {plus_line, true, RigFault::limit_switch_plus},
                        {minus_line, false, RigFault::limit_switch_minus}}) {
    sim.pull(c.line, c.pressed_high);
    const RigReading reading = rig->read();
    EXPECT_EQ(reading.status, RigStatus::fault);
    EXPECT_EQ(reading.fault, c.fault);
    sim.pull(c.line, !c.pressed_high);
    EXPECT_EQ(rig->read().status, RigStatus::fresh);
  }
}

TEST_F(GpioLines, AreKnownToWhoeverAsks) {
  const auto rig = opened();
  EXPECT_TRUE(rig->safety_inputs().emergency_stop);
  EXPECT_EQ(rig->safety_inputs().limit_switches, 2);
}

TEST_F(GpioLines, ACutWireOfANormallyClosedStopIsAStop) {
  const auto rig = made();
  rig->open();
  EXPECT_TRUE(sim.level(stop_line)) << "the bias pulls it up, nothing pulls it down";
  EXPECT_EQ(rig->read().fault, RigFault::emergency_stop);
}

TEST_F(GpioLines, TheStopComesBeforeWhateverElseIsWrong) {
  const auto rig = opened();
  behind.read_fault = RigFault::link_timeout;
  EXPECT_EQ(rig->read().fault, RigFault::link_timeout);
  sim.pull(plus_line, true);
  EXPECT_EQ(rig->read().fault, RigFault::limit_switch_plus);
  sim.pull(stop_line, true);
  EXPECT_EQ(rig->read().fault, RigFault::emergency_stop);
}

TEST_F(GpioLines, TheAmplifierIsOnFromTheFirstVoltageUntilTheStop) {
  const auto rig = opened();
  EXPECT_FALSE(sim.level(enable_line));
  rig->read();
  EXPECT_FALSE(sim.level(enable_line));
  EXPECT_EQ(rig->write(1.5), RigFault::none);
  EXPECT_TRUE(sim.level(enable_line));
  rig->stop();
  EXPECT_FALSE(sim.level(enable_line));
  EXPECT_TRUE(behind.stopped);
  rig->write(1.5);
  EXPECT_FALSE(sim.level(enable_line)) << "until it is opened again";
  rig->open();
  EXPECT_FALSE(sim.level(enable_line));
  rig->write(0.0);
  EXPECT_TRUE(sim.level(enable_line));
}

TEST_F(GpioLines, AnEnableThatIsActiveLowIsHighWhileOff) {
  file.gpio->amplifier_enable->active_high = false;
  const auto rig = opened();
  EXPECT_TRUE(sim.level(enable_line));
  rig->write(0.0);
  EXPECT_FALSE(sim.level(enable_line));
  rig->stop();
  EXPECT_TRUE(sim.level(enable_line));
}

TEST_F(GpioLines, AnUnsentVoltageEnablesNothingAndDoesNotBeat) {
  const auto rig = opened();
  behind.write_fault = RigFault::link_lost;
  const bool before = sim.level(beat_line);
  EXPECT_EQ(rig->write(1.0), RigFault::link_lost);
  EXPECT_FALSE(sim.level(enable_line));
  EXPECT_EQ(sim.level(beat_line), before);
}

TEST_F(GpioLines, TheHeartTogglesOncePerVoltageAndRestsAfterTheStop) {
  const auto rig = opened();
  bool last = sim.level(beat_line);
  for (int i = 0; i < 10; ++i) {
    rig->read();
    EXPECT_EQ(rig->write(0.1), RigFault::none);
    EXPECT_NE(sim.level(beat_line), last);
    last = sim.level(beat_line);
  }
  rig->stop();
  for (int i = 0; i < 5; ++i) {
    rig->write(0.1);
    EXPECT_EQ(sim.level(beat_line), last);
  }
}

TEST_F(GpioLines, StayOffWhenTheRestDoesNotOpen) {
  behind.opens = false;
  const auto rig = made();
  EXPECT_THROW(rig->open(), DeviceError);
  EXPECT_FALSE(sim.level(enable_line));
  behind.opens = true;
  rig->open();
  sim.pull(stop_line, false);
  sim.pull(minus_line, true);
  EXPECT_EQ(rig->read().status, RigStatus::fresh) << "opened again";
}

TEST_F(GpioLines, ALineHasOneUserOnly) {
  const auto rig = opened();
  const auto second = made();
  EXPECT_THROW(second->open(), DeviceError);
  rig->write(0.0);
  EXPECT_TRUE(sim.level(enable_line)) << "the first is not disturbed";
}

TEST_F(GpioLines, ALineThatCannotBeReadIsAFaultAndNotInactive) {
  const auto rig = opened();
  EXPECT_EQ(rig->read().status, RigStatus::fresh);
  sim.unplug();
  EXPECT_EQ(rig->read().fault, RigFault::line_failed);
  EXPECT_EQ(rig->write(0.0), RigFault::line_failed);
  rig->stop();
  EXPECT_TRUE(behind.stopped);
}

TEST_F(GpioLines, ARigWithoutLinesIsLeftAlone) {
  file.gpio->emergency_stop.reset();
  file.gpio->limit_switches.clear();
  file.gpio->amplifier_enable.reset();
  file.gpio->heartbeat.reset();
  auto plain = std::make_unique<RigBehind>(behind);
  const Rig* address = plain.get();
  EXPECT_EQ(with_gpio_lines(std::move(plain), file).get(), address);
}

}  // namespace
}  // namespace upright::test
