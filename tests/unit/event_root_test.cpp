#include "upright/sim/event_root.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace upright;

namespace {

/// An indicator that rises through zero once, and hardly bends within the step.
struct Cubic {
  double root_s, slope_per_s, bend, third;
  double operator()(double t) const {
    const double u = t - root_s;
    return u * (slope_per_s + u * (bend + u * third));
  }
  IndicatorSlope with_slope(double t) const {
    const double u = t - root_s;
    return {(*this)(t), slope_per_s + u * (2.0 * bend + u * 3.0 * third)};
  }
};

}  // namespace

TEST(EventRoot, NewtonFindsWhatBisectionFinds) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> share(0.01, 0.99), unit(-1.0, 1.0);
  constexpr double h = 4e-3, tolerance_s = 1e-9;
  for (int i = 0; i < 1000; ++i) {
    const double root_s = share(random) * h, slope_per_s = std::exp(5.0 * unit(random));
    const Cubic bent{root_s, slope_per_s, 50.0 * slope_per_s * unit(random),
                     2000.0 * slope_per_s * unit(random)};
    int evaluations = 0;
    const auto counted = [&](double t) {
      ++evaluations;
      return bent.with_slope(t);
    };
    const double guess_s = first_guess(bent(0.0), bent.with_slope(0.0).slope_per_s, bent(h), h);
    const auto found_s = newton_root(counted, guess_s, h, tolerance_s);
    ASSERT_TRUE(found_s);
    EXPECT_NEAR(*found_s, bent.root_s, tolerance_s);
    EXPECT_NEAR(*found_s, turning_positive(bent, bent(0.0), bent(h), h), 2.0 * tolerance_s);
    EXPECT_LE(evaluations, 3);
  }
}

TEST(EventRoot, TheGuessIsExactForAParabola) {
  const Cubic f{1.3e-3, 2.0, 150.0, 0.0};
  EXPECT_NEAR(first_guess(f(0.0), f.with_slope(0.0).slope_per_s, f(4e-3), 4e-3), 1.3e-3, 1e-15);
}

TEST(EventRoot, NewtonGivesUpOutsideTheStepAndWhereNothingRises) {
  const Cubic outside{5e-3, 1.0, 0.0, 0.0};
  EXPECT_FALSE(newton_root([&](double t) { return outside.with_slope(t); }, 2e-3, 4e-3, 1e-9));
  EXPECT_FALSE(newton_root([](double) { return IndicatorSlope{-1.0, 0.0}; }, 2e-3, 4e-3, 1e-9));
}
