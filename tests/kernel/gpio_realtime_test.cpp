// What the loop calls of lines and line encoders neither allocates nor locks, libgpiod included.
#include <gtest/gtest.h>
#include <pthread.h>

#include <cstdlib>
#include <memory>
#include <utility>

#include "../../hal/gpio/edge_source.hpp"
#include "../unit/counted_calls.hpp"
#include "hal/gpio_rig.hpp"
#include "shaft.hpp"

namespace upright::test {
namespace {

constexpr double fastest_edges_per_s = 20'000.0;
constexpr int a = 5, b = 6;

/// Encoders with an output that takes every voltage, so that enable and heartbeat follow.
class WithOutput final : public Rig {
 public:
  explicit WithOutput(std::unique_ptr<Rig> rig) : rig_(std::move(rig)) {}
  void open() override { rig_->open(); }
  RigReading read() noexcept override { return rig_->read(); }
  RigFault write(double) noexcept override { return RigFault::none; }
  StopReport stop() noexcept override { return rig_->stop(); }

 private:
  std::unique_ptr<Rig> rig_;
};

template <class Act>
void counted(Act act) {
  armed = true;
  act();
  armed = false;
}

class GpioRealtime : public ::testing::Test {
 protected:
  void SetUp() override { allocations = locks = 0; }
  void TearDown() override {
    EXPECT_EQ(allocations, 0);
    EXPECT_EQ(locks, 0);
  }

  GpioSim sim{"realtime", 8};
  Shaft shaft{sim, a, b};
  LineEncoder encoder{a, b, LineBias::as_is, fastest_edges_per_s};
};

TEST_F(GpioRealtime, TheCountersCount) {
  counted([] {
    pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
    pthread_mutex_lock(&mutex);
    pthread_mutex_unlock(&mutex);
    void* volatile memory = std::malloc(static_cast<std::size_t>(locks));  // not to be left out
    std::free(memory);
  });
  EXPECT_EQ(allocations, 2);
  EXPECT_EQ(locks, 1);
  SetUp();
}

TEST_F(GpioRealtime, LinesAndEncodersOfARig) {
  RigFile file;
  file.file = "rig.yaml";
  file.gpio.emplace();
  file.gpio->chip = sim.chip();
  file.gpio->emergency_stop = DigitalLine{0, true, LineBias::as_is};
  file.gpio->limit_switches = {{TrackEnd::plus_x, {1, true, LineBias::pull_down}}};
  file.gpio->amplifier_enable = DigitalLine{3, true, LineBias::as_is};
  file.gpio->heartbeat = 4;
  file.gpio->pendulum_encoder = encoder;
  const auto rig = with_gpio_lines(std::make_unique<WithOutput>(make_gpio_encoders(file, 0.01)), file);
  rig->open();
  for (std::int64_t i = 1; i <= 200; ++i) {
    shaft.turn_to(3 * i, 3000.0);
    RigReading reading;
    counted([&] {
      reading = rig->read();
      rig->write(0.0);
    });
    ASSERT_EQ(reading.status, RigStatus::fresh);
    ASSERT_EQ(reading.pendulum_counts, 3 * i);
    ASSERT_EQ(sim.level(4), i % 2 == 1);
  }
  sim.pull(0, true);
  RigReading pressed;
  counted([&] {
    pressed = rig->read();
    rig->stop();
  });
  EXPECT_EQ(pressed.fault, RigFault::emergency_stop);
  EXPECT_FALSE(sim.level(3));
}

TEST_F(GpioRealtime, EdgesByLibgpiod) {
  const GpioChip chip(sim.chip(), "rig.yaml");
  const auto source = stamped_edges(chip, encoder, "pendulum_encoder");
  QuadratureDecoder decoder(fastest_edges_per_s);
  decoder.start({});
  for (std::int64_t i = 1; i <= 200; ++i) {
    shaft.turn_to(3 * i, 3000.0);
    LinePair levels;
    counted([&] {
      source->drain(decoder, 0);
      source->read_levels(levels);
    });
    ASSERT_EQ(decoder.counts(), 3 * i);
    ASSERT_EQ(levels, decoder.levels());
  }
}

}  // namespace
}  // namespace upright::test
