// A model beside which a large random force or torque remains does not explain the data.
#include "diagnosis/large_disturbance.hpp"

#include <gtest/gtest.h>

namespace upright {
namespace {

struct Judged {
  bool found;
  ResidualTests tests;
};

/// Beside a motor with a largest force of 10 N and a pendulum of 2 N m: 0.3 N and 0.02 N m are usual.
Judged judge(const Noise& noise, ResidualTests tests = {}) {
  DataRange range;
  range.largest_force_n = 10.0;
  range.gravity_torque_nm = 2.0;
  const bool found = find_large_disturbance(noise, range, PriorPolicy{}, tests);
  return {found, tests};
}

TEST(LargeDisturbance, AUsualForceAndTorqueAreAccepted) {
  const Judged judged = judge({.coloured_force_n = 0.29, .coloured_torque_nm = 0.019});
  EXPECT_FALSE(judged.found);
  EXPECT_FALSE(judged.tests.structured);
  EXPECT_EQ(judged.tests.sentence, "");
}

TEST(LargeDisturbance, ALargerForceIsStatedWithItsSizeAndTime) {
  const Judged judged = judge({.coloured_force_n = 0.31, .correlation_s = 0.2});
  EXPECT_TRUE(judged.found);
  EXPECT_TRUE(judged.tests.structured);
  EXPECT_EQ(judged.tests.sentence,
            "a random force of 0.31 N remains, with a correlation time of 0.2 s; more than 0.3 N is no usual "
            "disturbance: something is missing, or the rig was disturbed");
}

TEST(LargeDisturbance, ALargerTorqueIsStated) {
  const Judged judged = judge({.coloured_torque_nm = 0.021});
  EXPECT_TRUE(judged.found);
  EXPECT_NE(judged.tests.sentence.find("a random torque of 0.021 N m remains"), std::string::npos);
}

TEST(LargeDisturbance, WhatATestHasFoundIsKept) {
  ResidualTests tests;
  tests.structured = true;
  tests.sentence = "bursts";
  const Judged judged = judge({.coloured_force_n = 5.0}, tests);
  EXPECT_FALSE(judged.found);
  EXPECT_EQ(judged.tests.sentence, "bursts");
}

TEST(LargeDisturbance, WithoutMotorAndPendulumNothingIsLarge) {
  ResidualTests tests;
  EXPECT_FALSE(find_large_disturbance({.coloured_force_n = 1.0, .coloured_torque_nm = 1.0}, DataRange{},
                                      PriorPolicy{}, tests));
}

}  // namespace
}  // namespace upright
