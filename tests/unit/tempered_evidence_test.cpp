// Evidence of data that count less than their likelihood says.
#include <gtest/gtest.h>

#include "diagnosis/search.hpp"

namespace upright {
namespace {

/// A fit of one number of the plant file, believed to be 3 with a deviation of 0.3.
Hypothesis fitted_to(double value, double likelihood, double information) {
  Hypothesis h;
  FreeParameter p;
  p.effect = effect_number("viscous_friction");
  p.prior_mean = 3.0;
  p.prior_sigma = 0.3;
  h.free = {p};
  h.train.point.plant.set("viscous_friction", {value});
  const double off = (value - p.prior_mean) / p.prior_sigma;
  h.train.segment_objective = {likelihood};
  h.train.block_objective = {likelihood};
  h.train.objective = likelihood + off * off;
  h.train.information = Eigen::MatrixXd::Constant(1, 1, information + 1.0 / (p.prior_sigma * p.prior_sigma));
  return h;
}

TEST(TemperedEvidence, IsThatOfTheLikelihoodForWhiteNoise) {
  const Hypothesis simpler = fitted_to(3.0, 1000.0, 50.0), richer = fitted_to(3.6, 800.0, 50.0);
  const Improvement improvement = compare(simpler, richer, 1.0);
  EXPECT_NEAR(improvement.train, 200.0 - 4.0, 1e-9);
  EXPECT_NEAR(improvement.prior, -4.0, 1e-9);
}

TEST(TemperedEvidence, CountsTheDataLessAndThePriorInFull) {
  const Hypothesis simpler = fitted_to(3.0, 1000.0, 1e9), richer = fitted_to(3.6, 800.0, 1e9);
  // The data hold the number where it is.
  const Improvement improvement = compare(simpler, richer, 20.0);
  EXPECT_NEAR(improvement.train, 200.0 / 20.0 - 4.0, 1e-3);
}

/// Data that hold a number loosely let it go back to what is believed of it.
TEST(TemperedEvidence, IsTakenAtTheTemperedOptimum) {
  const double information = 40.0, dispersion = 4.0, at = 3.6;
  const Hypothesis simpler = fitted_to(3.0, 1000.0, information), richer = fitted_to(at, 800.0, information);
  const double prior = 1.0 / 0.09, slope = -prior * (at - 3.0);
  double best = 1e9;
  for (double p = 3.0; p < 3.7; p += 1e-5) {
    const double d = p - at;
    const double likelihood = 800.0 + 2.0 * slope * d + information * d * d;
    best = std::min(best, likelihood / dispersion + prior * (p - 3.0) * (p - 3.0));
  }
  EXPECT_NEAR(compare(simpler, richer, dispersion).train, 1000.0 / dispersion - best, 1e-6);
}

}  // namespace
}  // namespace upright
