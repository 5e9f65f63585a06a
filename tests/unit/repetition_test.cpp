// When a search that found nothing is repeated with other runs held out, and which answer counts.
#include <gtest/gtest.h>

#include "diagnosis/repeated_search.hpp"
#include "upright/model/registry.hpp"

namespace upright {
namespace {

/// A training run and a held-out run, of which the held-out one may have the larger voltage.
class Repetition : public testing::Test {
 protected:
  Repetition() {
    runs_[0].voltage_v.assign(4, 2.0);
    runs_[1].voltage_v.assign(4, 1.0);
    for (Measurement& run : runs_) {
      run.time_s = {0.0, 0.01, 0.02, 0.03};
      run.cart_m.assign(4, 0.0);
    }
    data_.train = {&runs_, {{0, 0, 3}}};
    data_.held = {&runs_, {{1, 0, 3}}};
    data_.held_out_runs = {1};
  }

  bool is_worth_it() const { return may_find_more_with_other_runs(diagnosis_, data_, policy_); }
  void add_trial(double evidence, double held) {
    Trial trial;
    trial.effect = effect_number("quadratic_drag");
    trial.evidence = evidence;
    trial.held = held;
    diagnosis_.trials.push_back(trial);
  }

  std::vector<Measurement> runs_ = std::vector<Measurement>(2);
  DataSplit data_;
  Diagnosis diagnosis_;
  const SelectionPolicy policy_;
  const double enough_ = policy_.acceptance.min_evidence;
};

TEST_F(Repetition, IsNotWorthItWhereNothingWasTried) {
  EXPECT_FALSE(is_worth_it());
}

TEST_F(Repetition, NeedsTheLeastEvidenceOfAllRunsTogether) {
  add_trial(0.5 * enough_, 0.5 * enough_ - 0.1);
  EXPECT_FALSE(is_worth_it());
  add_trial(0.5 * enough_, 0.5 * enough_ + 0.1);
  EXPECT_TRUE(is_worth_it());
}

// What was rejected because held-out runs were against it may be right.
TEST_F(Repetition, IsWorthItDespiteHeldOutRunsAgainst) {
  add_trial(enough_ + 0.1, -enough_);
  EXPECT_TRUE(is_worth_it());
}

TEST_F(Repetition, IsWorthItIfTheLargestVoltageIsHeldOut) {
  runs_[1].voltage_v[2] = 2.1;
  EXPECT_TRUE(is_worth_it());
}

TEST(SecondAnswer, ThatExplainsMustFitAllRunsAsWell) {
  const AcceptancePolicy policy;
  EXPECT_TRUE(is_better_answer(-policy.min_evidence + 0.1, true, true, policy));
  EXPECT_TRUE(is_better_answer(-policy.min_evidence + 0.1, true, false, policy));
  EXPECT_FALSE(is_better_answer(-policy.min_evidence - 0.1, true, true, policy));
}

TEST(SecondAnswer, ThatExplainsNoMoreMustFitAllRunsFarBetter) {
  const AcceptancePolicy policy;
  EXPECT_TRUE(is_better_answer(policy.overwhelming_evidence + 0.1, false, true, policy));
  EXPECT_FALSE(is_better_answer(policy.overwhelming_evidence - 0.1, false, true, policy));
  EXPECT_FALSE(is_better_answer(policy.overwhelming_evidence + 0.1, false, false, policy));
}

}  // namespace
}  // namespace upright
