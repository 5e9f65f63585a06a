// Line encoders on the kernel's simulated chip: every count arrives, and no loss goes unnoticed.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <random>
#include <thread>

#include "../../hal/gpio/edge_source.hpp"
#include "hal/gpio_rig.hpp"
#include "shaft.hpp"
#include "upright/base/error.hpp"

namespace upright::test {
namespace {

using namespace std::chrono_literals;

constexpr int a = 2, b = 3;
constexpr double plenty = 20'000.0;  // edges per second
constexpr double unlimited = 1e9;    // where edges come in one burst
constexpr double period_s = 0.01;

RigFile rig_on(const GpioSim& sim, double fastest_edges_per_s) {
  RigFile file;
  file.file = "rig.yaml";
  file.calibration.pendulum.width_bits = 32;
  file.gpio.emplace();
  file.gpio->chip = sim.chip();
  file.gpio->pendulum_encoder = LineEncoder{a, b, LineBias::as_is, fastest_edges_per_s};
  return file;
}

std::int64_t now_ns() {
  MonotonicClock clock;
  return clock.now_ns();
}

/// Both ways in which edges come.
enum class Source { numbered, stamped };

std::unique_ptr<EdgeSource> make(Source source, const GpioChip& chip) {
  const LineEncoder encoder{a, b, LineBias::as_is, plenty};
  return source == Source::numbered ? numbered_edges(chip, encoder, "pendulum_encoder")
                                    : stamped_edges(chip, encoder, "pendulum_encoder");
}

class EdgeSources : public ::testing::TestWithParam<Source> {
 protected:
  GpioSim sim{"encoder", 8};
  Shaft shaft{sim, a, b};
  GpioChip chip{sim.chip(), "rig.yaml"};
  std::unique_ptr<EdgeSource> source = make(GetParam(), chip);
  QuadratureDecoder decoder{unlimited};

  void SetUp() override { decoder.start({}); }
  RigFault drain() {
    source->drain(decoder, now_ns());
    LinePair levels;
    EXPECT_TRUE(source->read_levels(levels));
    return decoder.compare(levels, now_ns());
  }
};

TEST_P(EdgeSources, CountBothWays) {
  for (const std::int64_t counts : {10, -7, -8, 4, 0}) {
    shaft.turn_to(counts);
    EXPECT_EQ(drain(), RigFault::none);
    EXPECT_EQ(decoder.counts(), counts);
  }
}

TEST_P(EdgeSources, ARandomWalkAtEveryStep) {
  std::mt19937 random(21);
  std::int64_t counts = 0;
  for (int i = 0; i < 1000; ++i) {
    counts += std::uniform_int_distribution<>(-6, 6)(random);
    shaft.turn_to(counts);
    ASSERT_EQ(drain(), RigFault::none);
    ASSERT_EQ(decoder.counts(), counts);
  }
}

TEST_P(EdgeSources, MoreThanTheQueueHoldsIsALossAndNeverACount) {
  const int queued = source->queue_edges();
  shaft.turn_to(queued - 2);
  EXPECT_EQ(drain(), RigFault::none);
  EXPECT_EQ(decoder.counts(), queued - 2);
  // A whole number of cycles more, so that the levels look as if nothing had happened.
  shaft.turn_to(queued - 2 + 4 * queued);
  EXPECT_EQ(drain(), RigFault::edges_lost);
  shaft.turn_to(0);
  EXPECT_EQ(drain(), RigFault::edges_lost) << "it stays";
}

TEST_P(EdgeSources, ALineHasOneUserOnly) {
  EXPECT_THROW(make(GetParam(), GpioChip(sim.chip(), "rig.yaml")), DeviceError);
}

std::string name_of(const ::testing::TestParamInfo<Source>& info) {
  return info.param == Source::numbered ? "Numbered" : "Stamped";
}

INSTANTIATE_TEST_SUITE_P(Gpio, EdgeSources, ::testing::Values(Source::numbered, Source::stamped), name_of);

class GpioEncoders : public ::testing::Test {
 protected:
  GpioSim sim{"encoders", 8};
  Shaft shaft{sim, a, b};
};

TEST_F(GpioEncoders, TheKernelNumbersEdges) {
  EXPECT_TRUE(numbers_edges(GpioChip(sim.chip(), "rig.yaml")));
}

TEST_F(GpioEncoders, KeepUpWithThousandsOfEdgesPerSecond) {
  const auto rig = make_gpio_encoders(rig_on(sim, plenty), period_s);
  rig->open();
  std::atomic<bool> turning{true};
  double rate = 0.0;
  std::thread motor([&] {
    for (const std::int64_t counts : {3000, -2000, 1111})
      rate = std::max(rate, shaft.turn_to(counts, 3000.0));
    turning = false;
  });
  std::uint64_t sequence = 0;
  while (turning) {
    const RigReading reading = rig->read();
    EXPECT_EQ(reading.status, RigStatus::fresh);
    EXPECT_GT(reading.sequence, sequence);
    sequence = reading.sequence;
    std::this_thread::sleep_for(10ms);
  }
  motor.join();
  const RigReading last = rig->read();
  EXPECT_EQ(last.status, RigStatus::fresh);
  EXPECT_EQ(last.pendulum_counts, 1111);
  EXPECT_EQ(last.cart_counts, 0) << "there is none";
  std::printf("%.0f edges per second\n", rate);
  EXPECT_GT(rate, 2500.0) << "the test means something";
}

TEST_F(GpioEncoders, KeepCountingWhenNobodyReads) {
  const auto rig = make_gpio_encoders(rig_on(sim, plenty), period_s);
  rig->open();
  EXPECT_EQ(rig->read().status, RigStatus::fresh);
  shaft.turn_to(3000, 2000.0);
  std::this_thread::sleep_for(100ms);
  rig->open();
  RigReading reading = rig->read();
  for (int i = 0; i < 3 && reading.status == RigStatus::stale; ++i) reading = rig->read();
  EXPECT_EQ(reading.status, RigStatus::fresh);
  EXPECT_EQ(reading.pendulum_counts, 3000) << "opening it again is no new zero";
}

TEST_F(GpioEncoders, EdgesBeyondTheLimitAreAFaultThatStays) {
  const auto rig = make_gpio_encoders(rig_on(sim, 200.0), period_s);
  rig->open();
  shaft.turn_to(50, 100.0);
  EXPECT_EQ(rig->read().status, RigStatus::fresh);
  shaft.turn_to(200);
  const RigReading reading = rig->read();
  EXPECT_EQ(reading.status, RigStatus::fault);
  EXPECT_EQ(reading.fault, RigFault::edges_too_fast);
  EXPECT_THROW(rig->open(), DeviceError);
}

TEST_F(GpioEncoders, StartAtWhateverLevelsThereAre) {
  for (int quarter = 0; quarter < 4; ++quarter) {
    shaft.turn_to(quarter);
    const auto rig = make_gpio_encoders(rig_on(sim, plenty), period_s);
    rig->open();
    EXPECT_EQ(rig->read().pendulum_counts, 0);
    shaft.turn_to(quarter + 9);
    EXPECT_EQ(rig->read().pendulum_counts, 9);
  }
}

TEST_F(GpioEncoders, CountBothEncodersInTheWidthOfTheCalibration) {
  RigFile file = rig_on(sim, plenty);
  file.gpio->cart_encoder = LineEncoder{6, 7, LineBias::as_is, plenty};
  file.calibration.pendulum.width_bits = 8;
  const auto rig = make_gpio_encoders(file, period_s);
  rig->open();
  Shaft(sim, 6, 7).turn_to(-25);
  shaft.turn_to(130);
  const RigReading reading = rig->read();
  EXPECT_EQ(reading.cart_counts, -25);
  EXPECT_EQ(reading.pendulum_counts, 130 - 256);
}

TEST_F(GpioEncoders, AChipThatGoesIsAFaultAndNotAStandstill) {
  const auto rig = make_gpio_encoders(rig_on(sim, plenty), period_s);
  rig->open();
  EXPECT_EQ(rig->read().status, RigStatus::fresh);
  sim.unplug();
  EXPECT_EQ(rig->read().fault, RigFault::line_failed);
  EXPECT_EQ(rig->read().fault, RigFault::line_failed);
}

TEST_F(GpioEncoders, HaveNoOutput) {
  const auto rig = make_gpio_encoders(rig_on(sim, plenty), period_s);
  rig->open();
  EXPECT_EQ(rig->write(1.0), RigFault::device_refused);
}

TEST_F(GpioEncoders, ALoopTooSlowForTheQueueIsRefused) {
  EXPECT_THROW(make_gpio_encoders(rig_on(sim, 8000.0), 0.1)->open(), ConfigError);
}

TEST_F(GpioEncoders, SayWhatIsWrongWithTheWiringOfTheFile) {
  const auto refusal = [](const RigFile& file) -> std::string {
    try {
      make_gpio_encoders(file, period_s)->open();
    } catch (const DeviceError& error) {
      return error.what();
    }
    return "";
  };
  RigFile file = rig_on(sim, plenty);
  file.gpio->chip = "gpiochip77";
  EXPECT_NE(refusal(file).find("gpiodetect"), std::string::npos) << refusal(file);
  file = rig_on(sim, plenty);
  file.gpio->pendulum_encoder->b = 8;
  EXPECT_NE(refusal(file).find("a line below 8"), std::string::npos) << refusal(file);
  file = rig_on(sim, plenty);
  const auto first = make_gpio_encoders(file, period_s);
  first->open();
  EXPECT_NE(refusal(file).find("end the other program first"), std::string::npos) << refusal(file);
}

}  // namespace
}  // namespace upright::test
