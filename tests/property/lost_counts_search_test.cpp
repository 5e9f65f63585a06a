// A counter that loses counts is found on a cart alone and below a pendulum. Nothing is named where the cart
// is never so fast.
#include <gtest/gtest.h>

#include "named_effects.hpp"

namespace upright {
namespace {

Plant with_counter(Plant plant, double share, double speed_mps) {
  plant.set("lost_counts", {share, speed_mps});
  return plant;
}

void expect_found(const Plant& believed, double share, double speed_mps) {
  const PlantEffect found = only_named(believed, with_counter(believed, share, speed_mps));
  expect_values(found, "lost_counts", {share, speed_mps}, 0.05);
}

TEST(LostCountsSearch, FindsACounterThatFollowsNoFaster) {
  expect_found(cart_with_friction(), 1.0, 0.15);
}

TEST(LostCountsSearch, FindsACounterThatLosesMostOfIt) {
  expect_found(cart_with_friction(), 0.7, 0.15);
}

TEST(LostCountsSearch, FindsItBelowAPendulum) {
  expect_found(cart_with_pendulum(), 1.0, 0.15);
}

TEST(LostCountsSearch, NamesNothingWhereTheCartIsSlow) {
  const Plant believed = cart_with_friction();
  const blind::Rig rig{.plant = with_counter(believed, 1.0, 5.0)};
  EXPECT_TRUE(diagnose(believed, three_runs(rig, 6.0, 5), {}).effects.empty());
}

}  // namespace
}  // namespace upright
