// Paired differences against textbook numbers.
#include "comparison/paired_comparison.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "comparison/student.hpp"

namespace upright {
namespace {

TEST(StudentQuantile, IsThatOfTheTables) {
  // Two-sided 95 percent, Abramowitz and Stegun, table 26.10.
  const std::pair<std::size_t, double> table[] = {{1, 12.706}, {4, 2.776},  {9, 2.262},  {20, 2.086},
                                                  {21, 2.080}, {30, 2.042}, {60, 2.000}, {120, 1.980}};
  for (const auto& [degrees, quantile] : table)
    EXPECT_NEAR(student_quantile(degrees), quantile, 1e-3) << degrees;
}

TEST(PairedDifference, HasTheIntervalOfThePairedTTest) {
  // Gosset's ten patients (Student, The probable error of a mean, 1908): extra sleep under two drugs.
  const Estimate gosset = paired_difference({1.2, 2.4, 1.3, 1.3, 0.0, 1.0, 1.8, 0.8, 4.6, 1.4});
  EXPECT_NEAR(gosset.value, 1.58, 1e-12);
  ASSERT_TRUE(gosset.ci95);
  EXPECT_NEAR((*gosset.ci95)[0], 0.700, 1e-3);
  EXPECT_NEAR((*gosset.ci95)[1], 2.460, 1e-3);
  EXPECT_FALSE(paired_difference({1.0}).ci95) << "one round tells no interval";
}

ComparedRun run_of(const std::string& controller, int round, double cart_m, bool fell = false) {
  ComparedRun run;
  run.controller = controller;
  run.round = round;
  run.behaviour.fell = fell;
  if (!fell) run.behaviour.behaviour = Behaviour{{Estimate{cart_m, {}}, {}, {}, {}}};
  return run;
}

TEST(CompareInRounds, TakesWhatDriftsOutOfTheDifference) {
  // The rig gets worse by 1 mm from round to round; the second controller is 0.5 mm better in each.
  std::vector<ComparedRun> runs;
  for (int round = 0; round < 4; ++round) {
    runs.push_back(run_of("a", round, 1e-3 * round + 2e-3));
    runs.push_back(run_of("b", round, 1e-3 * round + 1.5e-3 + (round % 2 == 0 ? 1e-5 : -1e-5)));
  }
  // A round that was interrupted, and one in which a controller fell.
  runs.push_back(run_of("a", 4, 9.0));
  runs.push_back(run_of("a", 5, 9.0));
  runs.push_back(run_of("b", 5, 0.0, true));
  const PieceComparison piece = compare_in_rounds("piece", runs);
  EXPECT_EQ(piece.first_controller, "a");
  EXPECT_EQ(piece.first_falls, 0);
  ASSERT_EQ(piece.others.size(), 1u);
  EXPECT_EQ(piece.others[0].rounds, 4u);
  EXPECT_EQ(piece.others[0].falls, 1);
  const PairedDifference& cart = piece.others[0].differences[0];
  EXPECT_NEAR(cart.from, 3.5e-3, 1e-12);
  EXPECT_NEAR(cart.difference.value, -0.5e-3, 1e-12);
  EXPECT_TRUE(cart.is_clear());
  EXPECT_LT((*cart.difference.ci95)[1], -0.4e-3) << "unpaired, the drift would hide it";
}

}  // namespace
}  // namespace upright
