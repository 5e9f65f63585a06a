// A search that leaves out each of its effects once, and comes back.
#include <gtest/gtest.h>

#include "diagnosis/plant_scale.hpp"
#include "diagnosis/stepwise_selection.hpp"
#include "estimation/held_out.hpp"
#include "named_effects.hpp"

namespace upright {
namespace {

/// A search in three runs of a rig, as a diagnosis makes it.
struct Selected {
  explicit Selected(const Plant& true_plant)
      : runs(three_runs(blind::Rig{.plant = true_plant}, 6.0, 1)),
        policy(policy_for(cart_with_friction())),
        data(split(runs, HeldOut::middle, policy.excitation.arm_m, policy.excitation.speed_window_s)),
        search(cart_with_friction(), runs, data.train, data.held, policy, budget),
        selection(search, options, record) {
    selection.begin();
    selection.find();
  }

  std::vector<Measurement> runs;
  SelectionPolicy policy;
  SearchBudget budget;
  DiagnosisOptions options;
  Diagnosis record;
  DataSplit data;
  Search search;
  StepwiseSelection selection;
};

TEST(StepwiseDetour, KeepsAModelThatNothingBeats) {
  Plant plant = cart_with_friction();
  plant.set("constant_force", {0.3});
  Selected s(plant);
  const std::vector<std::size_t> found = s.selection.found();
  ASSERT_EQ(found, std::vector<std::size_t>{effect_number("constant_force")});
  ASSERT_FALSE(s.selection.similar_effects(found.front()).empty());
  const double objective = s.selection.current().train.objective;
  EXPECT_FALSE(s.selection.find_without_each());
  EXPECT_EQ(s.selection.found(), found);
  EXPECT_EQ(s.selection.current().train.objective, objective);
}

}  // namespace
}  // namespace upright
