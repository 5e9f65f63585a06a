// The verdict of a diagnosis from what was found and what is left.
#include "diagnosis/verdict.hpp"

#include <gtest/gtest.h>

namespace upright {
namespace {

Diagnosis with_effect(double gap_before, double gap_after) {
  Diagnosis d;
  d.gap_before = gap_before;
  d.gap_after = gap_after;
  d.effects.emplace_back();
  return d;
}

TEST(Verdict, StructureIsUnexplainedWhateverWasFound) {
  EXPECT_EQ(verdict_of(with_effect(10.0, 1.0), {.structured = true}), Verdict::unexplained);
  EXPECT_EQ(verdict_of({}, {.structured = true}), Verdict::unexplained);
}

TEST(Verdict, AnEffectExplainsIfItClosesHalfOfAClearGap) {
  EXPECT_EQ(verdict_of(with_effect(10.0, 1.5), {}), Verdict::explained);
  EXPECT_EQ(verdict_of(with_effect(10.0, 5.4), {.clear_gap = true}), Verdict::explained);
  EXPECT_EQ(verdict_of(with_effect(10.0, 5.6), {.clear_gap = true}), Verdict::unexplained);
}

TEST(Verdict, NothingFoundNeedsDataThatWouldHaveShownIt) {
  EXPECT_EQ(verdict_of({}, {}), Verdict::no_discrepancy);
  EXPECT_EQ(verdict_of({}, {.may_hide = true}), Verdict::not_excited);
  EXPECT_EQ(verdict_of({}, {.clear_gap = true}), Verdict::not_excited);
  EXPECT_EQ(verdict_of({}, {.moves_enough = false}), Verdict::not_excited);
}

TEST(Verdict, WhatHelpsHereOnlyIsUnexplained) {
  Diagnosis d;
  d.helps_here_only.emplace_back();
  EXPECT_EQ(verdict_of(d, {}), Verdict::unexplained);
}

TEST(Verdict, TheReasonNamesTheGapAndWhatMayHide) {
  Diagnosis d;
  d.gap_after = 3.0;
  const std::string reason = why_not_excited(d, {.clear_gap = true}, {});
  EXPECT_NE(reason.find("3 times as far off as noise"), std::string::npos) << reason;
  EXPECT_TRUE(why_not_excited(d, {}, {}).empty());
}

}  // namespace
}  // namespace upright
