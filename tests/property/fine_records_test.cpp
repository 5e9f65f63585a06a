// Records that are finer than the motion: the search works on a part of the samples, and the answer is that
// of all of them.
#include <gtest/gtest.h>

#include <cmath>

#include "estimation/coarse_record.hpp"
#include "named_effects.hpp"

namespace upright {
namespace {

/// Three runs at 1 kHz with sensors that are not quantised, so that each sample counts.
std::vector<Measurement> fine_runs(const Plant& plant, unsigned seed) {
  blind::Rig rig{.plant = plant};
  rig.cart_step_m = 0.0;
  rig.cart_noise_m = 2e-5;
  rig.disturbance_n = 0.01;
  std::vector<Measurement> runs;
  for (unsigned r = 0; r < 3; ++r) {
    blind::Plan plan;
    plan.experiment = r == 1 ? blind::Experiment::square : blind::Experiment::multisine;
    plan.rate_hz = 1000.0;
    plan.duration_s = 8.0;
    plan.seed = 100 * seed + r;
    runs.push_back(measure(rig, plan, std::string("run").append(std::to_string(r))));
  }
  return runs;
}

/// The interval of the first parameter of the effect that was found first.
ParameterEstimate first_estimate(const Diagnosis& d) {
  return d.effects.empty() ? ParameterEstimate{} : d.effects.front().parameters.front();
}

TEST(FineRecords, NumbersAreThoseOfAllSamples) {
  Plant plant = cart_with_friction();
  plant.set("quadratic_drag", {4.0});
  const std::vector<Measurement> runs = fine_runs(plant, 1);
  const Diagnosis of_all = diagnose(cart_with_friction(), runs);
  const Diagnosis of_part =
      diagnose(cart_with_friction(), coarse_runs(runs, cart_with_friction(), {4e-3, 0.01}));
  ASSERT_FALSE(of_all.effects.empty());
  ASSERT_FALSE(of_part.effects.empty());
  EXPECT_EQ(kind_of(of_all.effects.front().effect), "quadratic_drag");
  EXPECT_EQ(of_all.effects.front().effect, of_part.effects.front().effect);
  const ParameterEstimate all = first_estimate(of_all), part = first_estimate(of_part);
  EXPECT_LT(all.high - all.low, part.high - part.low);
  EXPECT_NEAR(all.value, 4.0, 1.5 * (all.high - all.low));
}

TEST(FineRecords, ShowADelayShorterThanTheSamplesOfTheSearch) {
  Plant plant = cart_with_friction();
  plant.set("input_delay", {2.5e-3});
  const Diagnosis d = diagnose(cart_with_friction(), fine_runs(plant, 2));
  ASSERT_FALSE(d.effects.empty());
  EXPECT_EQ(kind_of(d.effects.front().effect), "input_delay");
  EXPECT_NEAR(first_estimate(d).value, 2.5e-3, 1e-4);
}

TEST(FineRecords, NoNamedEffectMayDoNothing) {
  Plant plant = cart_with_friction();
  plant.set("drive_compliance", {2e-4});
  for (const unsigned seed : {3, 4, 5})
    for (const FoundEffect& found : diagnose(cart_with_friction(), fine_runs(plant, seed)).effects) {
      const EffectInfo& info = effect_registry()[found.effect];
      if (info.parameters.size() > 1) continue;
      const ParameterEstimate& size = found.parameters.front();
      const double nothing = info.parameters.front().neutral;
      EXPECT_FALSE(size.low <= nothing && nothing <= size.high) << seed << ": " << info.kind;
    }
}

}  // namespace
}  // namespace upright
