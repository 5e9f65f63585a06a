// The size of an effect in each run, from linear equations with a known answer.
#include "estimation/size_by_run.hpp"

#include <gtest/gtest.h>

#include <random>

#include "model/dense_algebra.hpp"
#include "upright/model/registry.hpp"

namespace upright {
namespace {

/// Rows y = a p + noise of segments: parameter 0 is common, parameter 1 has a value of its own in each run.
struct LinearRuns {
  std::vector<ParameterEquations> equations;
  std::vector<Segment> segments;
};

/// `correlated`: the share of the noise that a whole segment has in common.
LinearRuns linear_runs(const std::vector<double>& sizes, double correlated, unsigned seed) {
  constexpr int segments_of_run = 8, rows = 50;
  constexpr double common = 0.7;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  LinearRuns result;
  for (std::size_t run = 0; run < sizes.size(); ++run)
    for (int s = 0; s < segments_of_run; ++s) {
      ParameterEquations e{Eigen::MatrixXd::Zero(2, 2), Eigen::VectorXd::Zero(2)};
      const double shared = correlated * normal(random);
      for (int i = 0; i < rows; ++i) {
        const Eigen::Vector2d row(normal(random), 1.0);
        const double y = common * row[0] + sizes[run] * row[1] + shared + normal(random);
        e.information += row * row.transpose();
        e.score += y * row;
      }
      result.equations.push_back(e);
      result.segments.push_back({run, 0, rows - 1});
    }
  return result;
}

/// Both parameters are zero at the point, and nothing is believed of them.
SizeByRun sizes_of(const LinearRuns& runs) {
  FitPoint point;
  point.plant.set("viscous_friction", {0.0});
  point.plant.set("constant_force", {0.0});
  std::vector<FreeParameter> free(2);
  free[0].effect = effect_number("viscous_friction");
  free[1].effect = effect_number("constant_force");
  return size_by_run(runs.equations, runs.segments, point, free, 1);
}

TEST(SizeByRun, FindsTheSizeOfEachRun) {
  const std::vector<double> truth = {1.0, -0.5, 2.0};
  const SizeByRun sizes = sizes_of(linear_runs(truth, 0.0, 1));
  ASSERT_EQ(sizes.runs, (std::vector<std::size_t>{0, 1, 2}));
  for (Eigen::Index r = 0; r < 3; ++r)
    EXPECT_NEAR(sizes.value[r], truth[static_cast<std::size_t>(r)], 4.0 * std::sqrt(sizes.covariance(r, r)));
  EXPECT_EQ(sizes.freedom, 21.0);
}

/// Of 300 runs: whether the 95 percent intervals hold as often as they say.
double coverage(double correlated) {
  int holds = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const SizeByRun sizes = sizes_of(linear_runs({0.3, 0.3, 0.3}, correlated, seed));
    for (Eigen::Index r = 0; r < 3; ++r)
      holds += std::abs(sizes.value[r] - 0.3) < 1.96 * std::sqrt(sizes.covariance(r, r)) ? 1 : 0;
  }
  return holds / 300.0;
}

TEST(SizeByRun, IntervalsHoldForWhiteAndForCorrelatedNoise) {
  EXPECT_GT(coverage(0.0), 0.92);
  EXPECT_GT(coverage(1.0), 0.90);
}

}  // namespace
}  // namespace upright
