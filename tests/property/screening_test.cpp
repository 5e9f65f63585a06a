// The screening of candidates: what their derivatives promise, and when the noise is estimated again.
#include <gtest/gtest.h>

#include <limits>

#include "diagnosis/plant_scale.hpp"
#include "diagnosis/search.hpp"
#include "estimation/held_out.hpp"
#include "named_effects.hpp"

namespace upright {
namespace {

constexpr double unreachable = -std::numeric_limits<double>::infinity();

/// A few steps from the starts of its prediction, with the noise as it is.
Hypothesis with_former_noise(const Search& search, const Hypothesis& base, std::size_t effect) {
  return search.screened(base, effect, search.predictions(base, {effect}).front().starts, unreachable);
}

/// Runs of a rig with a constant force that its plant file lacks.
class Screening : public ::testing::Test {
 protected:
  static Plant rig() {
    Plant plant = cart_with_friction();
    plant.set("constant_force", {0.3});
    return plant;
  }

  std::vector<Measurement> runs_ = three_runs(blind::Rig{.plant = rig()}, 6.0, 2);
  SelectionPolicy policy_ = policy_for(cart_with_friction());
  SearchBudget budget_;
  DataSplit data_ =
      split(runs_, HeldOut::middle, policy_.excitation.arm_m, policy_.excitation.speed_window_s);
  Search search_{cart_with_friction(), runs_, data_.train, data_.held, policy_, budget_};
  Hypothesis base_ = search_.baseline();
  std::size_t hidden_ = effect_number("constant_force");
};

TEST_F(Screening, KeepsTheNoiseOfACandidateThatGainsTooLittle) {
  const Noise& before = base_.train.point.noise;
  const Hypothesis kept = with_former_noise(search_, base_, hidden_);
  const Hypothesis renewed = search_.screened(base_, hidden_);
  EXPECT_EQ(kept.train.point.noise.force, before.force);
  EXPECT_LT(renewed.train.point.noise.force, before.force);
  EXPECT_LT(renewed.train.objective, kept.train.objective);
}

// A prediction below a tenth of the least evidence can therefore rule a candidate out.
TEST_F(Screening, GainsWhatTheDerivativesPromise) {
  const double without = search_.descended_on_subset(base_).train.objective;
  const double gained = without - with_former_noise(search_, base_, hidden_).train.objective;
  const double promised = search_.predictions(base_, {hidden_}).front().gain;
  ASSERT_GT(gained, policy_.acceptance.min_evidence);
  EXPECT_GT(promised, 0.5 * gained);
  EXPECT_LT(promised, 2.0 * gained);
}

// Short pitches are many, and each explains a part of the noise.
TEST(PeriodicScreening, FindsALongPitchAmongShortOnes) {
  const Plant given = cart_with_friction();
  const SelectionPolicy policy = policy_for(given);
  const SearchBudget budget;
  const std::size_t hidden = effect_number("encoder_eccentricity");
  Plant plant = given;
  plant.set(hidden, std::vector<double>{0.0015, 0.075, -1.9});
  int found = 0;
  for (int seed = 1; seed <= 8; ++seed) {
    const std::vector<Measurement> runs = three_runs(blind::Rig{.plant = plant}, 6.0, seed);
    const DataSplit data =
        split(runs, HeldOut::middle, policy.excitation.arm_m, policy.excitation.speed_window_s);
    Search search{given, runs, data.train, data.held, policy, budget};
    const Hypothesis base = search.baseline();
    const double without = search.descended_on_subset(base).train.objective;
    found += without - with_former_noise(search, base, hidden).train.objective > 100.0 ? 1 : 0;
  }
  EXPECT_GE(found, 7);
}

}  // namespace
}  // namespace upright
