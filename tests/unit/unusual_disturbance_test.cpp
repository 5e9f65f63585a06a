// A model beside which a large or drifting random force or torque remains does not explain the data.
#include "diagnosis/unusual_disturbance.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace upright {
namespace {

struct Judged {
  bool found;
  ResidualTests tests;
};

/// A motor with a root mean square force of 6 N and a pendulum of 2 N m: 0.3 N and 0.02 N m are usual.
DataRange usual_range() {
  DataRange range;
  range.motor_force_rms_n = 6.0;
  range.gravity_torque_nm = 2.0;
  return range;
}

Judged judge(const Noise& noise, ResidualTests tests = {}) {
  const bool found = find_unusual_disturbance(noise, usual_range(), PriorPolicy{}, tests);
  return {found, tests};
}

TEST(UnusualDisturbance, AUsualForceAndTorqueAreAccepted) {
  const Judged judged = judge({.coloured_force_n = 0.29, .coloured_torque_nm = 0.019});
  EXPECT_FALSE(judged.found);
  EXPECT_FALSE(judged.tests.structured);
  EXPECT_EQ(judged.tests.sentence, "");
}

TEST(UnusualDisturbance, ALargerForceIsStatedWithItsSizeAndTime) {
  const Judged judged = judge({.coloured_force_n = 0.31, .correlation_s = 0.2});
  EXPECT_TRUE(judged.found);
  EXPECT_TRUE(judged.tests.structured);
  EXPECT_EQ(judged.tests.sentence,
            "a random force of 0.31 N remains, with a correlation time of 0.2 s; more than 0.3 N is no usual "
            "disturbance: something is missing, or the rig was disturbed");
}

TEST(UnusualDisturbance, ALargerTorqueIsStated) {
  const Judged judged = judge({.coloured_torque_nm = 0.021});
  EXPECT_TRUE(judged.found);
  EXPECT_NE(judged.tests.sentence.find("a random torque of 0.021 N m remains"), std::string::npos);
}

TEST(UnusualDisturbance, AWhiteForceCountsWithItsMeanOverAPulse) {
  const double over_a_tenth = std::sqrt(0.1);
  EXPECT_FALSE(judge({.force = 0.29 * over_a_tenth, .torque = 0.019 * over_a_tenth}).found);
  EXPECT_TRUE(judge({.torque = 0.021 * over_a_tenth}).found);
  const Judged judged = judge({.force = 0.31 * over_a_tenth});
  EXPECT_TRUE(judged.found);
  EXPECT_EQ(
      judged.tests.sentence,
      "a random force of 0.31 N remains on average over a tenth of a second; more than 0.3 N is no usual "
      "disturbance: something is missing, or the rig was disturbed");
  // Both parts are independent, so their variances add.
  EXPECT_FALSE(judge({.force = 0.2 * over_a_tenth, .coloured_force_n = 0.2}).found);
  EXPECT_TRUE(judge({.force = 0.2 * over_a_tenth, .coloured_force_n = 0.25}).found);
}

TEST(UnusualDisturbance, CountsWithTheSizeThatPulsesHave) {
  ResidualTests tests;
  tests.statistics.pulse_size = {1.5, InnovationStatistics::not_shown};
  EXPECT_FALSE(judge({.coloured_force_n = 0.19}, tests).found);
  const Judged judged = judge({.coloured_force_n = 0.21, .correlation_s = 0.2}, tests);
  EXPECT_TRUE(judged.found);
  EXPECT_NE(judged.tests.sentence.find("a random force of 0.315 N remains"), std::string::npos);
}

TEST(UnusualDisturbance, AForceThatLastsTooLongDrifts) {
  const double just_shorter_s = std::nextafter(longest_correlation_s, 0.0);
  EXPECT_FALSE(judge({.coloured_force_n = 0.1, .correlation_s = just_shorter_s}).found);
  const Judged judged = judge({.coloured_force_n = 0.1, .correlation_s = longest_correlation_s});
  EXPECT_TRUE(judged.found);
  EXPECT_EQ(
      judged.tests.sentence,
      "a random force of 0.1 N remains, with a correlation time of 3 s or more: it drifts, so something "
      "is missing that changes slowly");
  EXPECT_FALSE(judge({.correlation_s = longest_correlation_s}).found);
}

TEST(UnusualDisturbance, WhatATestHasFoundIsKept) {
  ResidualTests tests;
  tests.structured = true;
  tests.sentence = "bursts";
  const Judged judged = judge({.coloured_force_n = 5.0}, tests);
  EXPECT_FALSE(judged.found);
  EXPECT_EQ(judged.tests.sentence, "bursts");
}

TEST(UnusualDisturbance, ALargeForceOfTheTrackIsNotExplained) {
  Diagnosis diagnosis;
  diagnosis.verdict = Verdict::explained;
  report_track_force({0.29, 0.02}, usual_range(), PriorPolicy{}, diagnosis);
  EXPECT_EQ(diagnosis.verdict, Verdict::explained);
  ASSERT_EQ(diagnosis.notes.size(), 1u);
  EXPECT_NE(diagnosis.notes[0].find("a random force of the track"), std::string::npos);

  report_track_force({0.31, 0.02}, usual_range(), PriorPolicy{}, diagnosis);
  EXPECT_EQ(diagnosis.verdict, Verdict::unexplained);
  EXPECT_EQ(diagnosis.notes.size(), 1u);
  EXPECT_NE(diagnosis.residual.find("more than 0.3 N is no usual disturbance"), std::string::npos);
}

TEST(UnusualDisturbance, WithoutMotorAndPendulumNothingIsLarge) {
  ResidualTests tests;
  EXPECT_FALSE(find_unusual_disturbance({.coloured_force_n = 1.0, .coloured_torque_nm = 1.0}, DataRange{},
                                        PriorPolicy{}, tests));
}

}  // namespace
}  // namespace upright
