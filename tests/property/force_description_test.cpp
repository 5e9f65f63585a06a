// A force that no effect of the registry is: the diagnosis draws it as a curve, and only where there is one.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "blind_case.hpp"
#include "diagnosis/described_curve.hpp"
#include "named_effects.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {
namespace {

std::optional<DescribedCurve> curve_in(const Diagnosis& diagnosis) {
  for (const FoundEffect& effect : diagnosis.effects)
    if (const auto curve = described_curve(effect)) return curve;
  return std::nullopt;
}

/// Correlation of a curve with sin(2 pi v / period), but for what back-EMF and friction may take of each.
double likeness(const DescribedCurve& curve, double period) {
  const auto n = static_cast<Eigen::Index>(curve.at.size());
  Eigen::MatrixXd taken(n, 3);
  Eigen::VectorXd drawn(n), ripple(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double v = curve.at[static_cast<std::size_t>(i)];
    taken.row(i) << 1.0, v, v > 0.0 ? 1.0 : -1.0;
    drawn[i] = curve.force_n[static_cast<std::size_t>(i)];
    ripple[i] = std::sin(2.0 * M_PI * v / period);
  }
  const Eigen::HouseholderQR<Eigen::MatrixXd> factor(taken);
  drawn -= taken * factor.solve(drawn).eval();
  ripple -= taken * factor.solve(ripple).eval();
  return drawn.dot(ripple) / (drawn.norm() * ripple.norm());
}

TEST(ForceDescription, DrawsARippleOverTheVelocity) {
  for (const unsigned seed : {1, 2, 3}) {
    blind::Rig rig{.plant = cart_with_friction(), .unknown = blind::Unknown::velocity_ripple};
    rig.unknown_size = 0.3;
    rig.unknown_period = 0.4;
    const Diagnosis d = diagnose(cart_with_friction(), three_runs(rig, 6.0, seed));
    EXPECT_EQ(d.verdict, Verdict::described) << seed << ": " << d.residual;
    EXPECT_LT(3.0 * d.gap_after, d.gap_before) << seed;
    const auto curve = curve_in(d);
    ASSERT_TRUE(curve) << seed;
    EXPECT_EQ(curve->over, "velocity") << seed;
    EXPECT_NE(d.model.find("force_table"), nullptr);
    EXPECT_GT(likeness(*curve, rig.unknown_period), 0.9) << seed;
  }
}

/// At other places the force of a rough track is not known, and its level is the best guess.
TEST(ForceDescription, EndsAtItsLevelBesideTheMeasuredTrack) {
  int drawn = 0;
  for (const unsigned seed : {7, 8, 9}) {
    blind::Rig rig{.plant = cart_with_friction(), .unknown = blind::Unknown::rough_track};
    rig.unknown_size = 1.0;
    rig.unknown_period = 0.02;
    rig.track_seed = seed;
    const std::vector<Measurement> runs = three_runs(rig, 6.0, seed);
    const auto curve = curve_in(diagnose(cart_with_friction(), runs, {}));
    if (!curve) continue;
    ++drawn;
    EXPECT_EQ(curve->over, "position") << seed;
    for (const Measurement& run : runs) {
      const auto [low, high] = std::minmax_element(run.cart_m.begin(), run.cart_m.end());
      EXPECT_LT(curve->at.front(), *low) << seed;
      EXPECT_GT(curve->at.back(), *high) << seed;
    }
    const auto [least, greatest] = std::minmax_element(curve->force_n.begin(), curve->force_n.end());
    EXPECT_NEAR(curve->force_n.front(), curve->force_n.back(), 1e-2 * (*greatest - *least)) << seed;
    EXPECT_GT(curve->force_n.front(), *least) << seed;
    EXPECT_LT(curve->force_n.front(), *greatest) << seed;
  }
  EXPECT_GT(drawn, 0);
}

/// A weak dead zone in 12 s of data. The training runs show a curve over the velocity with an evidence of 46,
/// beside which the other parameters move, and the held-out run contradicts it.
TEST(ForceDescription, NeedsHeldOutRunsThatAgree) {
  blind::Request request =
      blind::laboratory_request(blind::seed_of_case(20261225, 13), {"voltage_dead_zone"});
  request.size = blind::Size::weak;
  request.max_samples = 6000.0;
  const blind::Case blind = make_case(request);
  const Diagnosis d = diagnose(blind.believed, measure_all(blind));
  EXPECT_EQ(d.verdict, Verdict::explained) << d.residual;
}

TEST(ForceDescription, DrawsNothingWhereNothingIsMissing) {
  for (const unsigned seed : {4, 5, 6}) {
    blind::Rig rig{.plant = cart_with_friction()};
    rig.disturbance_n = 0.05;
    const Diagnosis d = diagnose(cart_with_friction(), three_runs(rig, 6.0, seed));
    EXPECT_FALSE(curve_in(d)) << seed;
    EXPECT_NE(d.verdict, Verdict::described) << seed;
  }
}

}  // namespace
}  // namespace upright
