// The range of what runs measured, and what lies beyond it.
#include "diagnosis/motion_range.hpp"

#include <gtest/gtest.h>

namespace upright {
namespace {

/// A cart that moves from rest between two places in a second, with constant acceleration, at 100 Hz.
Measurement run_between(double from_m, double to_m) {
  Measurement run;
  constexpr int count = 101;
  for (int k = 0; k < count; ++k) {
    run.time_s.push_back(0.01 * k);
    run.cart_m.push_back(from_m + (to_m - from_m) * 1e-4 * k * k);
    run.voltage_v.push_back(k % 2 == 0 ? -3.0 : 2.0);
  }
  return run;
}

TEST(MotionRange, ItCoversAllRuns) {
  const auto range = motion_range({run_between(0.1, 0.3), run_between(0.2, -0.2)}, 0.025);
  ASSERT_EQ(range.size(), 3u);
  EXPECT_EQ(range[0].quantity, "cart_m");
  EXPECT_DOUBLE_EQ(range[0].low, -0.2);
  EXPECT_DOUBLE_EQ(range[0].high, 0.3);
  EXPECT_EQ(range[1].quantity, "cart_mps");
  EXPECT_NEAR(range[1].low, -0.8 * 0.99, 1e-9);  // the mean of the last 20 ms, in steps of two samples
  EXPECT_NEAR(range[1].high, 0.4 * 0.99, 1e-9);
  EXPECT_EQ(range_text({range[2]}), "voltage_v -3 to 2 V");
}

TEST(MotionRange, TheVoltageOfALockedCartDoesNotCount) {
  Measurement run = run_between(0.0, 1.0);
  run.theta_rad = run.cart_m;
  run.cart_m.clear();
  run.cart_locked = true;
  const auto range = motion_range({run}, 0.025);
  ASSERT_EQ(range.size(), 2u);
  EXPECT_EQ(range[0].quantity, "theta_rad");
  EXPECT_EQ(range[1].quantity, "theta_radps");
}

TEST(MotionRange, ARunBeyondItIsToldByItsQuantity) {
  const auto fitted = motion_range({run_between(0.0, 0.2)}, 0.025);
  EXPECT_TRUE(beyond_range(motion_range({run_between(0.01, 0.21)}, 0.025), fitted).empty());
  const auto beyond = beyond_range(motion_range({run_between(0.2, 0.4)}, 0.025), fitted);
  ASSERT_EQ(beyond.size(), 1u);
  EXPECT_EQ(beyond[0].quantity, "cart_m");
  EXPECT_DOUBLE_EQ(beyond[0].high, 0.4);
}

TEST(MotionRange, WhatWasNotFittedIsNotCompared) {
  EXPECT_TRUE(beyond_range(motion_range({run_between(0.0, 0.2)}, 0.025), {}).empty());
}

}  // namespace
}  // namespace upright
