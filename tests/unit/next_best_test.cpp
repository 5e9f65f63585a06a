// Which name came next to the one that was taken.
#include <gtest/gtest.h>

#include "diagnosis/search_budget.hpp"
#include "upright/diagnosis/diagnosis.hpp"
#include "upright/model/registry.hpp"

namespace upright {
namespace {

Trial trial_of(std::size_t round, const char* kind, double evidence, bool taken = false) {
  Trial trial;
  trial.round = round;
  trial.effect = effect_number(kind);
  trial.evidence = evidence;
  trial.taken = taken;
  return trial;
}

/// Coulomb friction first, then an asymmetry, which a constant force comes near.
class NextBestName : public testing::Test {
 protected:
  NextBestName() {
    diagnosis_.trials = {trial_of(0, "coulomb_friction", 9000.0, true),
                         trial_of(1, "viscous_asymmetry", 900.0, true), trial_of(1, "constant_force", 700.0),
                         trial_of(1, "cable_spring", 690.0)};
  }

  NextBest of(const char* kind, const std::vector<std::size_t>& indistinguishable_from = {}) const {
    FoundEffect found;
    found.effect = effect_number(kind);
    found.indistinguishable_from = indistinguishable_from;
    return next_best(diagnosis_, found);
  }

  Diagnosis diagnosis_;
};

TEST_F(NextBestName, IsOfTheSameRoundTheBestFirst) {
  const NextBest best = of("viscous_asymmetry");
  EXPECT_EQ(kind_of(best.taken->effect), "viscous_asymmetry");
  ASSERT_EQ(best.others.size(), 2u);
  EXPECT_EQ(kind_of(best.others[0]->effect), "constant_force");
  EXPECT_EQ(kind_of(best.others[1]->effect), "cable_spring");
}

TEST_F(NextBestName, IsOneAboveAShareOfTheEvidenceAndNoneBelowIt) {
  const double limit = 9000.0 * SearchBudget{}.resembling_share;
  diagnosis_.trials.push_back(trial_of(0, "voltage_gain", 1.01 * limit));
  diagnosis_.trials.push_back(trial_of(0, "voltage_offset", 0.99 * limit));
  const NextBest best = of("coulomb_friction");
  ASSERT_EQ(best.others.size(), 1u);
  EXPECT_EQ(kind_of(best.others[0]->effect), "voltage_gain");
}

TEST_F(NextBestName, IsNotOneThatWasRefusedForAllItsEvidence) {
  diagnosis_.trials.push_back(trial_of(1, "bristle_friction", 5000.0));
  EXPECT_EQ(of("viscous_asymmetry").others.size(), 2u);
}

TEST_F(NextBestName, IsNotOneThatIsNotToldApart) {
  const NextBest best = of("viscous_asymmetry", {effect_number("constant_force")});
  ASSERT_EQ(best.others.size(), 1u);
  EXPECT_EQ(kind_of(best.others[0]->effect), "cable_spring");
}

TEST_F(NextBestName, IsNoneOfWhatWasNotTriedAlone) {
  EXPECT_TRUE(of("cart_mass").others.empty());
}

}  // namespace
}  // namespace upright
