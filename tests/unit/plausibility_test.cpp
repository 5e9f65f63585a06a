// Both sides of what an effect or a correction can be.
#include "diagnosis/plausibility.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/candidates.hpp"
#include "diagnosis/place_null.hpp"

namespace upright {
namespace {

constexpr CorrectionPolicy policy;
constexpr SignificancePolicy levels;

double above(double value) {
  return std::nextafter(value, 1e9);
}
double below(double value) {
  return std::nextafter(value, -1e9);
}

/// One number that was believed to be 0, with a standard error of 1.
std::vector<std::size_t> certain(double value, bool is_correction) {
  return certain_parameters(
      {Eigen::VectorXd::Constant(1, value), Eigen::VectorXd::Zero(1), Eigen::MatrixXd::Identity(1, 1)},
      {is_correction}, levels);
}

TEST(Correction, IsThereFromItsMinimumCertaintyOn) {
  EXPECT_TRUE(certain(below(levels.certain_z), true).empty());
  EXPECT_EQ(certain(levels.certain_z, true).size(), 1u);
  EXPECT_EQ(certain(0.0, false).size(), 1u) << "what is no correction stays";
}

TEST(Correction, FollowsWhereOneThatIsAlikeIsSetBack) {
  // Alone each is 5 standard errors off; they go together, and the first is a little less certain.
  ParameterPosterior posterior{Eigen::Vector2d(3.9, 5.0), Eigen::Vector2d::Zero(),
                               Eigen::Matrix2d::Identity()};
  posterior.covariance(0, 1) = posterior.covariance(1, 0) = -0.9;
  EXPECT_EQ(certain_parameters(posterior, {true, true}, levels), std::vector<std::size_t>{1});
  // The other way round the second gives way as the first is set back.
  posterior.covariance(0, 1) = posterior.covariance(1, 0) = 0.9;
  EXPECT_EQ(certain_parameters(posterior, {true, true}, levels), std::vector<std::size_t>{});
}

TEST(Correction, MustIncludeNothingOnAllRunsNoLonger) {
  EXPECT_FALSE(is_certain_of_all_runs(below(levels.interval_z), levels));
  EXPECT_TRUE(is_certain_of_all_runs(levels.interval_z, levels));
}

TEST(Correction, IsAsBelievedWithinWhatCoefficientsMove) {
  const double sigma = 0.5, far = levels.noticeable_z * sigma;
  EXPECT_TRUE(is_within_prior(below(far), 0.0, sigma, levels));
  EXPECT_FALSE(is_within_prior(far, 0.0, sigma, levels));
  EXPECT_FALSE(is_within_prior(-far, 0.0, sigma, levels));
}

TEST(Scale, IsAtAnEndOfItsRangeJustBeforeIt) {
  const double low = 0.3 * (1.0 + end_tolerance), high = 3.0 * (1.0 - end_tolerance);
  EXPECT_EQ(end_of_range(below(low), 0.3, 3.0), EndOfRange::low);
  EXPECT_EQ(end_of_range(low, 0.3, 3.0), EndOfRange::none);
  EXPECT_EQ(end_of_range(below(high), 0.3, 3.0), EndOfRange::none);
  EXPECT_EQ(end_of_range(high, 0.3, 3.0), EndOfRange::high);
}

TEST(Scale, IsDoubtfulBeyondADataSheet) {
  constexpr PriorPolicy prior;
  EXPECT_FALSE(is_doubtful(std::exp(prior.doubtful_scale - 1e-9), prior));
  EXPECT_TRUE(is_doubtful(std::exp(prior.doubtful_scale + 1e-9), prior));
  EXPECT_TRUE(is_doubtful(std::exp(-prior.doubtful_scale - 1e-9), prior));
}

TEST(AngleOffset, ShowsFromAStepAndAHalfOn) {
  const double step = 0.001, min_offset = policy.min_angle_offset_steps * step;
  EXPECT_FALSE(shows_on_encoder(below(min_offset), step, policy));
  EXPECT_TRUE(shows_on_encoder(min_offset, step, policy));
  EXPECT_TRUE(shows_on_encoder(-min_offset, step, policy));
}

TEST(Bristles, AreShortWithinATenthOfTheTravel) {
  constexpr PriorPolicy prior;
  const double travel_m = 0.5, stiffness = 20.0,
               longest = stiffness * prior.bristle_share_of_travel * travel_m;
  EXPECT_TRUE(are_bristles_short(below(longest), stiffness, travel_m, prior));
  EXPECT_FALSE(are_bristles_short(longest, stiffness, travel_m, prior));
}

TEST(HeldOutRuns, MayBeAsFarOffAgainAsAllRunsAre) {
  EXPECT_FALSE(is_held_out_too_far_off(levels.clear_ratio, 0.5, levels));
  EXPECT_TRUE(is_held_out_too_far_off(above(levels.clear_ratio), 0.5, levels));
  EXPECT_FALSE(is_held_out_too_far_off(1.5 * levels.clear_ratio, 1.5, levels));
  EXPECT_TRUE(is_held_out_too_far_off(above(1.5 * levels.clear_ratio), 1.5, levels));
}

TEST(CertaintyBesideTrack, IsLessWhereFewPlacesWereSeen) {
  EXPECT_NEAR(certainty_beside_track(9.0, 1e6, 1.0), 3.0, 1e-3);
  // Six places and a constant: t = sqrt(16 * 5 / 6) with five degrees of freedom, two-sided p = 0.0145.
  EXPECT_NEAR(certainty_beside_track(16.0, 6.0, 1.0), 2.44, 0.03);
  EXPECT_LT(certainty_beside_track(16.0, 6.0, 2.0), certainty_beside_track(16.0, 6.0, 1.0));
  // One degree of freedom is the least.
  EXPECT_EQ(certainty_beside_track(16.0, 1.2, 1.0), certainty_beside_track(16.0, 2.0, 1.0));
  EXPECT_EQ(certainty_beside_track(-1.0, 6.0, 1.0), 0.0);
}

TEST(Runs, MoveEnoughBeyondTheStepsOfASensor) {
  constexpr ExcitationPolicy excitation;
  const auto moves = [&](double range_m) {
    Measurement run;
    run.cart_m = {0.0, range_m};
    run.known_cart_noise_m = 1.0 / std::sqrt(12.0);
    run.known_theta_noise_rad = 1.0;
    return moves_enough({run}, excitation);
  };
  EXPECT_FALSE(moves(excitation.min_steps - 1e-9));
  EXPECT_TRUE(moves(excitation.min_steps + 1e-9));
}

}  // namespace
}  // namespace upright
