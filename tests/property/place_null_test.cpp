// A track that is a little rough is not taken for a named effect, and an effect is still found on it.
#include <gtest/gtest.h>

#include "named_effects.hpp"

namespace upright {
namespace {

/// Runs on a track whose force has a standard deviation of `rough_n`.
std::vector<Measurement> runs_on_rough_track(const Plant& plant, unsigned seed, double rough_n = 0.08,
                                             double length_m = 0.015) {
  blind::Rig rig{.plant = plant};
  rig.rough_n = rough_n;
  rig.rough_length_m = length_m;
  rig.track_seed = seed;
  return three_runs(rig, 6.0, seed);
}

TEST(PlaceNull, ARoughTrackIsNoNamedEffect) {
  for (const unsigned seed : {1, 2, 3, 4, 5, 6})
    EXPECT_EQ(named_effects(runs_on_rough_track(cart_with_friction(), seed), cart_with_friction()),
              std::set<std::string>{})
        << seed;
}

/// The waves of such a track are as long as a tenth of the travel: some resemble a periodic force.
TEST(PlaceNull, AVeryRoughTrackIsNoCoggingForce) {
  for (const unsigned seed : {1, 2, 3})
    EXPECT_FALSE(
        named_effects(runs_on_rough_track(cart_with_friction(), seed, 0.6, 0.025), cart_with_friction())
            .contains("cogging_force"))
        << seed;
}

/// The waves of this track are an eighth of the travel, so its force does not average out there.
TEST(PlaceNull, TheAverageForceOfATrackIsNoConstantForce) {
  for (const unsigned seed : {2, 3})
    EXPECT_EQ(named_effects(runs_on_rough_track(cart_with_friction(), seed, 0.1, 0.05), cart_with_friction()),
              std::set<std::string>{})
        << seed;
}

TEST(PlaceNull, AConstantForceIsNamedOnARoughTrack) {
  Plant tilted = cart_with_friction();
  tilted.set("constant_force", {0.3});
  for (const unsigned seed : {1, 2})
    EXPECT_TRUE(
        named_effects(runs_on_rough_track(tilted, seed), cart_with_friction()).contains("constant_force"))
        << seed;
}

TEST(PlaceNull, AnEffectIsNamedOnARoughTrack) {
  Plant cogging = cart_with_friction(), spring = cart_with_friction();
  cogging.set("cogging_force", {0.25, 0.03, 1.0});
  spring.set("cable_spring", {8.0, 0.0});
  for (const unsigned seed : {1, 2, 3}) {
    EXPECT_TRUE(
        named_effects(runs_on_rough_track(cogging, seed), cart_with_friction()).contains("cogging_force"))
        << seed;
    EXPECT_TRUE(
        named_effects(runs_on_rough_track(spring, seed), cart_with_friction()).contains("cable_spring"))
        << seed;
  }
}

}  // namespace
}  // namespace upright
