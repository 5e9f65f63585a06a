// The limits that `margin` prints, against a search over gains by the characteristic roots.
#include "design/physical_limits.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <vector>

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

using Polynomial = std::vector<double>;  ///< coefficients, the constant first

std::complex<double> at(const Polynomial& polynomial, std::complex<double> s) {
  std::complex<double> sum = 0.0;
  for (auto c = polynomial.rbegin(); c != polynomial.rend(); ++c) sum = sum * s + *c;
  return sum;
}

/// Whether all zeros of own(s) + delayed(s) e^(-s delay) are in the left half plane, by the argument
/// principle (Mikhailov): along the imaginary axis the phase then turns by a quarter for each degree. Both
/// polynomials may have the same degree (a neutral equation); own's leading coefficient is 1, delayed's is
/// smaller.
bool is_stable(const Polynomial& own, const Polynomial& delayed, double delay_s) {
  const std::size_t degree = own.size() - 1;
  const double leading = delayed.size() == own.size() ? delayed.back() : 0.0;
  if (std::abs(leading) >= 1.0 || own[0] + delayed[0] <= 0.0) return false;
  double size = 1.0;
  for (const double c : own) size = std::max(size, std::abs(c));
  for (const double c : delayed) size = std::max(size, std::abs(c));
  const double highest_radps = 40.0 * size, step_radps = 0.05 / delay_s;
  std::complex<double> before = own[0] + delayed[0];
  double turned_rad = 0.0;
  for (double w = 0.0; w < highest_radps;) {
    w += std::min(step_radps, 1e-3 + 0.02 * w);
    const std::complex<double> s(0.0, w), value = at(own, s) + at(delayed, s) * std::exp(-s * delay_s);
    turned_rad += std::arg(value / before);
    before = value;
    if (w >= highest_radps) turned_rad -= std::arg(1.0 + leading * std::exp(-s * delay_s));
  }
  return std::abs(turned_rad - 0.5 * std::numbers::pi * static_cast<double>(degree)) < 0.5;
}

/// Whether gains on angle, rate and acceleration hold theta'' = theta + u(t - delay), in units of 1 / rate.
bool any_holds_with_acceleration(double delay) {
  for (const double a : {0.0, 0.5, 0.8, 0.9, 0.95, 0.98, 0.995})
    for (const double p : {1.0001, 1.001, 1.01, 1.1})
      for (double d = 0.4; d < 2.4; d += 0.02)
        if (is_stable({-1.0, 0.0, 1.0}, {p, d, a}, delay)) return true;
  return false;
}

TEST(PhysicalLimits, PdWithAccelerationIsWhatASearchFinds) {
  EXPECT_TRUE(is_stable({-1.0, 0.0, 1.0}, {1.01, 1.0, 0.0}, 0.5)) << "the criterion itself";
  EXPECT_FALSE(is_stable({-1.0, 0.0, 1.0}, {1.01, 1.0, 0.0}, 1.5)) << "the criterion itself";
  const PhysicalLimits limits = physical_limits(viscous());
  const double limit = limits.with_acceleration_s * limits.unstable_rate_radps;
  EXPECT_TRUE(any_holds_with_acceleration(0.97 * limit));
  EXPECT_FALSE(any_holds_with_acceleration(1.02 * limit));
}

/// Whether the controller that gives y' = y + u, u = -(the delayed terms), holds it for every delay to
/// `delay`.
bool holds_all(const Polynomial& own, const Polynomial& delayed, double delay) {
  for (const double share : {1.0, 0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9})
    if (!is_stable(own, delayed, share * delay)) return false;
  return true;
}

TEST(PhysicalLimits, NoLinearControllerFoundExceedsItsLimit) {
  const PhysicalLimits limits = physical_limits(viscous());
  const double limit = limits.linear_controller_s * limits.plant_pole_radps;
  // u = -(k y + d y'), the best of low order (Ma and Chen, IEEE Trans. Automatic Control 64, 2019), comes
  // near.
  bool near = false;
  for (const double d : {0.9, 0.95, 0.98})
    for (double k = 1.0001; k < 1.05; k += 0.002) near = near || holds_all({-1.0, 1.0}, {k, d}, 0.9 * limit);
  EXPECT_TRUE(near);
  // Controllers of second order: (s - 1)(s^2 + a1 s + a0) + (b3 s^3 + b2 s^2 + b1 s + b0) e^(-s delay).
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  int holding = 0;
  for (int i = 0; i < 3000; ++i) {
    const double a0 = std::exp(3.0 * any(random)), a1 = std::exp(3.0 * any(random));
    const double b0 = a0 * (1.0 + 0.2 * std::abs(any(random)));
    const Polynomial own{-a0, a0 - a1, a1 - 1.0, 1.0};
    const Polynomial delayed{b0, a1 + a0 * any(random), 1.0 + a1 * any(random), 0.98 * any(random)};
    if (holds_all(own, delayed, 0.3 * limit)) ++holding;
    EXPECT_FALSE(holds_all(own, delayed, 1.02 * limit)) << i;
  }
  EXPECT_GT(holding, 100) << "controllers that hold at all";
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
