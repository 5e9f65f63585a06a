// How far a parameter may be from a bound, against quantiles that are known.
#include "estimation/parameter_covariance.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace upright {
namespace {

TEST(ReachFromBounds, IsThatOfAHalfNormalWithoutADraw) {
  const Eigen::MatrixXd information{{4.0}};
  const Eigen::VectorXd score{{0.0}};
  const double two_sided_95 = 1.959964;
  EXPECT_NEAR(reach_from_bounds(information, score, 1.0, {true})[0], two_sided_95 * 0.5, 1e-6);
  EXPECT_NEAR(reach_from_bounds(information, score, 9.0, {true})[0], two_sided_95 * 1.5, 1e-6);
}

TEST(ReachFromBounds, IsThatOfAnExponentialUnderAStrongDraw) {
  const Eigen::MatrixXd information{{4.0}};
  for (const double slope : {-1000.0, 1000.0})
    EXPECT_NEAR(reach_from_bounds(information, Eigen::VectorXd{{slope}}, 1.0, {true})[0],
                std::log(20.0) / 1000.0, 1e-5);
}

TEST(ReachFromBounds, FallsWithTheDrawAndHasNoStep) {
  double former = reach_from_bounds(Eigen::MatrixXd{{1.0}}, Eigen::VectorXd{{0.0}}, 1.0, {true})[0];
  for (double slope = 0.05; slope < 40.0; slope += 0.05) {
    const double reach = reach_from_bounds(Eigen::MatrixXd{{1.0}}, Eigen::VectorXd{{-slope}}, 1.0, {true})[0];
    EXPECT_LT(reach, 1.002 * former) << slope;
    EXPECT_GT(reach, 0.95 * former) << slope;
    former = reach;
  }
}

TEST(ReachFromBounds, LetsTheOtherParametersFollow) {
  const Eigen::MatrixXd information{{4.0, 3.0}, {3.0, 4.0}};
  const Eigen::VectorXd reach =
      reach_from_bounds(information, Eigen::VectorXd{{0.0, 0.0}}, 1.0, {true, false});
  EXPECT_NEAR(reach[0], 1.959964 / std::sqrt(4.0 - 9.0 / 4.0), 1e-6);
  EXPECT_EQ(reach[1], 0.0);
}

}  // namespace
}  // namespace upright
