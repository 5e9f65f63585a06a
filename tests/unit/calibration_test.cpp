// Unwrapping, scaling and register layouts, over random inputs.
#include "upright/hal/calibration.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "hal/modbus/registers.hpp"

namespace upright {
namespace {

TEST(Unwrapper, FollowsRandomWalksOfAnyWidth) {
  std::mt19937_64 random(1);
  for (int width = 8; width <= 32; ++width) {
    const std::int64_t range = std::int64_t{1} << width;
    std::uniform_int_distribution<std::int64_t> step(-range / 2, range / 2 - 1), any(0, range - 1);
    const std::int64_t zero = any(random);
    std::int64_t position = signed_counts(any(random), width);
    Unwrapper unwrapper(width);
    // The device shows its counter unsigned or signed; both must do.
    const auto shown = [&](int i) {
      const std::int64_t low_bits = (zero + position) & (range - 1);
      return i % 2 == 0 ? low_bits : signed_counts(low_bits, width);
    };
    unwrapper.start(shown(0), zero);
    ASSERT_EQ(unwrapper.total(), position);
    for (int i = 1; i < 2000; ++i) {
      position += step(random);
      ASSERT_EQ(unwrapper.follow(shown(i)), position) << "width " << width;
    }
  }
}

TEST(PoseScaler, GoesBackToThePoseTheCountsCameFrom) {
  std::mt19937 random(2);
  std::uniform_real_distribution<> cart(-0.4, 0.4), angle(-6, 6);
  for (int i = 0; i < 1000; ++i) {
    Calibration calibration;
    calibration.cart = {2.27485e-5, i % 2 == 0 ? 1 : -1, 24, 5};
    calibration.pendulum = {2 * std::numbers::pi / 4096, i % 3 == 0 ? 1 : -1, 16, 60};
    calibration.cart_zero_counts = i * 8191;
    calibration.pendulum_zero_counts = i * 13;
    calibration.zero_pose = i % 5 == 0 ? ZeroPose::hanging : ZeroPose::upright;
    PoseScaler scaler(calibration);
    const Pose pose{cart(random), angle(random)};
    const EncoderCounts counts = counts_at(pose, calibration);
    const Pose back = scaler.scale(counts.cart, counts.pendulum);
    EXPECT_NEAR(back.cart_m, pose.cart_m, 0.5001 * calibration.cart.per_count);
    EXPECT_NEAR(back.theta_rad, pose.theta_rad, 0.5001 * calibration.pendulum.per_count);
  }
}

TEST(PoseScaler, HangingStartLiftedEitherWayIsUpright) {
  for (const int way : {1, -1}) {
    Calibration calibration;
    calibration.cart = {1e-5, 1, 32, 5};
    calibration.pendulum = {2 * std::numbers::pi / 4096, 1, 12, 60};
    calibration.zero_at_start = true;
    calibration.zero_pose = ZeroPose::hanging;
    PoseScaler scaler(calibration);
    EXPECT_DOUBLE_EQ(scaler.scale(77, 5).theta_rad, std::numbers::pi);
    for (int i = 1; i <= 2048 / 32; ++i) scaler.scale(77, 5 + way * 32 * i);
    EXPECT_NEAR(scaler.nearest_turn().theta_rad, 0.0, 1e-12);
    EXPECT_NEAR(scaler.scale(77, 5 + way * 2048 + 1).theta_rad, 2 * std::numbers::pi / 4096, 1e-12);
  }
}

TEST(SafeVoltage, ClampsAndRefusesWhatIsNotFinite) {
  EXPECT_EQ(safe_voltage(std::numeric_limits<double>::quiet_NaN(), 10), 0.0);
  EXPECT_EQ(safe_voltage(std::numeric_limits<double>::infinity(), 10), 0.0);
  EXPECT_EQ(safe_voltage(-std::numeric_limits<double>::infinity(), 10), 0.0);
  EXPECT_EQ(safe_voltage(10.5, 10), 10.0);
  EXPECT_EQ(safe_voltage(-1e300, 10), -10.0);
  EXPECT_EQ(safe_voltage(-3.25, 10), -3.25);
}

TEST(ImplausibleStep, KnowsTheFastestMotion) {
  const EncoderCalibration encoder{1e-5, 1, 16, 5.0};
  EXPECT_FALSE(implausible_step(0, 500, 1e-3, encoder));
  EXPECT_TRUE(implausible_step(0, 510, 1e-3, encoder));
  EXPECT_FALSE(implausible_step(65535, 100, 1e-3, encoder)) << "across the wrap";
}

TEST(ModbusRegisters, CountersGoRoundInEveryLayout) {
  std::mt19937 random(3);
  for (const int registers : {1, 2}) {
    for (const WordOrder order : {WordOrder::high_first, WordOrder::low_first}) {
      const CounterFormat format{registers, order};
      for (int i = 0; i < 2000; ++i) {
        const std::int64_t counts = registers == 1 ? random() & 0xffff : random();
        std::array<std::uint16_t, 2> words{};
        encode_counter(counts, format, words);
        ASSERT_EQ(decode_counter(words, format), counts);
      }
    }
  }
  const std::array<std::uint16_t, 2> words = {0x0001, 0x0002};
  EXPECT_EQ(decode_counter(words, {2, WordOrder::high_first}), 0x00010002);
  EXPECT_EQ(decode_counter(words, {2, WordOrder::low_first}), 0x00020001);
}

TEST(ModbusRegisters, VoltagesGoRoundInEveryLayout) {
  std::mt19937 random(4);
  std::uniform_real_distribution<> voltage(-24, 24);
  for (const auto encoding : {VoltageEncoding::int16, VoltageEncoding::int32, VoltageEncoding::float32}) {
    for (const WordOrder order : {WordOrder::high_first, WordOrder::low_first}) {
      const VoltageFormat format{encoding, order, 1000.0};
      for (int i = 0; i < 2000; ++i) {
        const double v = voltage(random);
        ASSERT_NEAR(decode_voltage(encode_voltage(v, format), format), v,
                    encoding == VoltageEncoding::float32 ? 2e-6 : 0.5001e-3);
      }
      EXPECT_EQ(decode_voltage(encode_voltage(std::nan(""), format), format), 0.0);
      EXPECT_NEAR(decode_voltage(encode_voltage(1e300, format), format), format.largest_v(),
                  1e-6 * format.largest_v());
    }
  }
  EXPECT_EQ(encode_voltage(-1.0, {VoltageEncoding::int16, WordOrder::high_first, 1000.0})[0], 0xfc18);
}

}  // namespace
}  // namespace upright
