// The ranges of the parameters that a diagnosis fits.
#include "diagnosis/candidates.hpp"

#include <gtest/gtest.h>

namespace upright {
namespace {

DataRange motor_pushes_with(double force_n) {
  DataRange range;
  range.largest_force_n = force_n;
  range.largest_speed_mps = 0.5;
  range.longest_travel_m = 0.03;
  return range;
}

double most(const char* effect, const DataRange& range, const PriorPolicy& prior = {}) {
  return free_parameters(effect_number(effect), range, prior)[0].high;
}

TEST(Candidates, FrictionIsAtMostTwiceTheForceOfTheMotor) {
  EXPECT_DOUBLE_EQ(most("coulomb_friction", motor_pushes_with(10.0)), 20.0);
}

TEST(Candidates, TheMotorCanStretchASpringOverHalfTheTrack) {
  EXPECT_DOUBLE_EQ(most("cable_spring", motor_pushes_with(10.0)), 20.0 / 0.5);
  PriorPolicy long_track;
  long_track.spring_center_m = 5.0;
  EXPECT_DOUBLE_EQ(most("cable_spring", motor_pushes_with(10.0), long_track), 20.0 / 5.0);
}

TEST(Candidates, WithoutAMotorNothingLimitsASpring) {
  EXPECT_GT(most("cable_spring", motor_pushes_with(0.0)), 1e6);
}

}  // namespace
}  // namespace upright
