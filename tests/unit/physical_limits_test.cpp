// The limits that `margin` prints, against a search over gains by the characteristic roots.
#include "design/physical_limits.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "design/characteristic_roots.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {
namespace {

Plant viscous() {
  return read_plant_file(UPRIGHT_SOURCE_DIR "/config/plants/viscous.yaml");
}

/// Whether any gains on angle and rate hold theta'' = w^2 theta + u(t - delay): the smallest stabilizing
/// gains are at the limit p = w^2, where the double root at zero leaves.
bool any_holds(double rate_radps, double delay_s) {
  const double square = rate_radps * rate_radps;
  DelayedFeedback loop{Eigen::MatrixXd::Zero(2, 2), Eigen::VectorXd::Zero(2), Eigen::RowVectorXd::Zero(2)};
  loop.a << 0.0, 1.0, square, 0.0;
  loop.b << 0.0, 1.0;
  for (const double p : {1.0001, 1.0003, 1.001, 1.003, 1.01, 1.03, 1.1, 1.3})
    for (double d = 0.5; d < 2.0; d += 0.01) {
      loop.k << -p * square, -d * rate_radps;
      if (rightmost_root(loop, delay_s).real() < 0.0) return true;
    }
  return false;
}

TEST(PhysicalLimits, PdIsWhatASearchOverGainsFinds) {
  const PhysicalLimits limits = physical_limits(viscous());
  EXPECT_TRUE(any_holds(limits.unstable_rate_radps, 0.97 * limits.proportional_derivative_s));
  EXPECT_FALSE(any_holds(limits.unstable_rate_radps, 1.02 * limits.proportional_derivative_s));
}

TEST(PhysicalLimits, FollowTheirFormulas) {
  const PhysicalLimits limits = physical_limits(viscous());
  EXPECT_NEAR(limits.unstable_rate_radps, std::sqrt(9.8 / (4.0 / 3.0 * 0.305)), 1e-9);
  EXPECT_NEAR(limits.with_acceleration_s / limits.proportional_derivative_s, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(limits.linear_controller_s * limits.plant_pole_radps, 2.0, 1e-12);
  EXPECT_GT(limits.plant_pole_radps, 4.0);
  EXPECT_LT(limits.plant_pole_radps, 6.0);
}

}  // namespace
}  // namespace upright
