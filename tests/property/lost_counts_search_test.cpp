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
  const blind::Rig rig{.plant = with_counter(believed, share, speed_mps)};
  const Diagnosis d = diagnose(believed, three_runs(rig, 6.0, 5), {});
  EXPECT_EQ(d.verdict, Verdict::explained);
  ASSERT_EQ(d.effects.size(), 1u);
  ASSERT_EQ(kind_of(d.effects.front().effect), "lost_counts");
  const PlantEffect& found = *d.model.find(d.effects.front().effect);
  EXPECT_NEAR(found.values[0], share, 0.05 * share);
  EXPECT_NEAR(found.values[1], speed_mps, 0.05 * speed_mps);
}

TEST(LostCountsSearch, FindsACounterThatFollowsNoFaster) {
  expect_found(cart_with_friction(), 1.0, 0.15);
}

TEST(LostCountsSearch, FindsACounterThatLosesMostOfIt) {
  expect_found(cart_with_friction(), 0.7, 0.15);
}

TEST(LostCountsSearch, FindsItBelowAPendulum) {
  Plant believed = cart_with_friction();
  believed.pendulum = Pendulum{0.21, 0.305, {}};
  expect_found(believed, 1.0, 0.15);
}

TEST(LostCountsSearch, NamesNothingWhereTheCartIsSlow) {
  const Plant believed = cart_with_friction();
  const blind::Rig rig{.plant = with_counter(believed, 1.0, 5.0)};
  EXPECT_TRUE(diagnose(believed, three_runs(rig, 6.0, 5), {}).effects.empty());
}

}  // namespace
}  // namespace upright
