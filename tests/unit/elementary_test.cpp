// Elementary functions against those of libm in extended precision, and that they are nobody else's.
#include "upright/model/elementary.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "upright/model/dual_number.hpp"

namespace upright {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// How far a value is from the true one, in units of the last place of a double there.
double units_off(double value, long double truth) {
  const double size = std::abs(static_cast<double>(truth));
  const double unit = std::nextafter(size, infinity) - size;
  return static_cast<double>(std::abs(static_cast<long double>(value) - truth)) / unit;
}

/// The largest error over random arguments of every magnitude up to `largest`.
template <class Function, class Truth>
double worst(const Function& function, const Truth& truth, double largest) {
  constexpr int samples = 20000;
  std::mt19937_64 random(1);
  double worst = 0.0;
  for (double scale = largest; scale > 1e-3; scale *= 0.25) {
    std::uniform_real_distribution<double> within(-scale, scale);
    for (int i = 0; i < samples; ++i) {
      const double x = within(random);
      worst = std::max(worst, units_off(function(x), truth(static_cast<long double>(x))));
    }
  }
  return worst;
}

TEST(Elementary, SineAndCosineErrBelowOneUnit) {
  const auto sine = [](double x) { return elementary::sin(x); };
  const auto cosine = [](double x) { return elementary::cos(x); };
  // Up to here the long double's own reduction is exact enough to judge by.
  EXPECT_LT(worst(
                sine, [](long double x) { return std::sin(x); }, 1e6),
            0.8);
  EXPECT_LT(worst(
                cosine, [](long double x) { return std::cos(x); }, 1e6),
            0.8);
}

TEST(Elementary, SineAndCosineTogetherAreThoseAlone) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> within(-20.0, 20.0);
  for (int i = 0; i < 10000; ++i) {
    const double x = within(random);
    const auto both = elementary::sine_and_cosine(x);
    EXPECT_EQ(both.sine, elementary::sin(x));
    EXPECT_EQ(both.cosine, elementary::cos(x));
  }
}

TEST(Elementary, SineIsExactNearMultiplesOfPi) {
  for (const double turns : {0.5, 1.0, 2.0, 7.0, 1000.5, 99999.0}) {
    const double x = turns * std::numbers::pi;
    EXPECT_LT(units_off(elementary::sin(x), std::sin(static_cast<long double>(x))), 0.8) << x;
    EXPECT_LT(units_off(elementary::cos(x), std::cos(static_cast<long double>(x))), 0.8) << x;
  }
}

TEST(Elementary, SineStaysBoundedForHugeAngles) {
  for (const double x : {1.7e6, 1e9, 1e15, 1e300, -1e300}) EXPECT_LE(std::abs(elementary::sin(x)), 1.0);
  EXPECT_NEAR(elementary::sin(1e7), std::sin(1e7), 1e-9);
}

TEST(Elementary, ExponentialsErrBelowOneUnit) {
  const auto exponential = [](double x) { return elementary::exp(x); };
  const auto less_one = [](double x) { return elementary::expm1(x); };
  EXPECT_LT(worst(
                exponential, [](long double x) { return std::exp(x); }, 708.0),
            0.9);
  EXPECT_LT(worst(
                less_one, [](long double x) { return std::expm1(x); }, 708.0),
            0.9);
}

TEST(Elementary, LogarithmErrsBelowOneUnit) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> mantissas(0.5, 1.0);
  for (int i = 0; i < 20000; ++i)
    for (const int exponent : {0, 1, 2, -20, 30, -1000, 1000}) {
      const double x = std::ldexp(mantissas(random), exponent);
      ASSERT_LT(units_off(elementary::log(x), std::log(static_cast<long double>(x))), 0.9) << x;
    }
}

TEST(Elementary, HyperbolicTangentErrsBelowThreeUnits) {
  const auto tangent = [](double x) { return elementary::tanh(x); };
  EXPECT_LT(worst(
                tangent, [](long double x) { return std::tanh(x); }, 30.0),
            3.0);
}

TEST(Elementary, PowerErrsWithTheExponentOfItsResult) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> bases(0.0, 10.0), exponents(0.1, 10.0);
  for (int i = 0; i < 10000; ++i) {
    const double x = bases(random), y = exponents(random);
    const double off = units_off(elementary::power(x, y),
                                 std::pow(static_cast<long double>(x), static_cast<long double>(y)));
    EXPECT_LT(off, 2.0 + 2.0 * std::abs(y * std::log(x))) << x << " " << y;
  }
}

TEST(Elementary, SpecialValuesAreExact) {
  EXPECT_EQ(elementary::sin(0.0), 0.0);
  EXPECT_TRUE(std::signbit(elementary::sin(-0.0)));
  EXPECT_EQ(elementary::cos(0.0), 1.0);
  EXPECT_EQ(elementary::exp(0.0), 1.0);
  EXPECT_EQ(elementary::exp(710.0), infinity);
  EXPECT_EQ(elementary::exp(-746.0), 0.0);
  EXPECT_EQ(elementary::exp(-infinity), 0.0);
  EXPECT_EQ(elementary::exp(-745.0), std::numeric_limits<double>::denorm_min());
  EXPECT_EQ(elementary::expm1(0.0), 0.0);
  EXPECT_EQ(elementary::expm1(-infinity), -1.0);
  EXPECT_EQ(elementary::log(1.0), 0.0);
  EXPECT_EQ(elementary::log(0.0), -infinity);
  EXPECT_EQ(elementary::log(infinity), infinity);
  EXPECT_EQ(elementary::tanh(50.0), 1.0);
  EXPECT_EQ(elementary::tanh(-50.0), -1.0);
  EXPECT_TRUE(std::signbit(elementary::tanh(-0.0)));
  EXPECT_EQ(elementary::power(0.0, 2.5), 0.0);
  EXPECT_EQ(elementary::power(0.0, 0.0), 1.0);
  EXPECT_EQ(elementary::hypot(3.0, -4.0), 5.0);
}

TEST(Elementary, NotANumberStaysOne) {
  for (const double x : {not_a_number, infinity, -infinity}) {
    EXPECT_TRUE(std::isnan(elementary::sin(x)));
    EXPECT_TRUE(std::isnan(elementary::cos(x)));
  }
  EXPECT_TRUE(std::isnan(elementary::exp(not_a_number)));
  EXPECT_TRUE(std::isnan(elementary::expm1(not_a_number)));
  EXPECT_TRUE(std::isnan(elementary::log(not_a_number)));
  EXPECT_TRUE(std::isnan(elementary::log(-1.0)));
  EXPECT_TRUE(std::isnan(elementary::tanh(not_a_number)));
}

TEST(Elementary, DualNumbersCarryTheDerivative) {
  using Dual = DualNumber<1>;
  const Dual x(0.7, 0);
  EXPECT_EQ(elementary::sin(x).a, elementary::sin(0.7));
  EXPECT_DOUBLE_EQ(elementary::sin(x).v[0], std::cos(0.7));
  EXPECT_DOUBLE_EQ(elementary::sine_and_cosine(x).cosine.v[0], -std::sin(0.7));
  EXPECT_DOUBLE_EQ(elementary::exp(x).v[0], std::exp(0.7));
  EXPECT_DOUBLE_EQ(elementary::log(x).v[0], 1.0 / 0.7);
  EXPECT_NEAR(elementary::tanh(x).v[0], 1.0 - std::tanh(0.7) * std::tanh(0.7), 1e-15);
}

// Recorded here; the same on every machine, or a log of one does not replay on another.
TEST(Elementary, BitsAreTheSameOnEveryMachine) {
  double sum = 0.0;
  for (int i = 1; i <= 10000; ++i) {
    const double x = 0.001 * i;
    sum += elementary::sin(x) + elementary::cos(3.0 * x) + elementary::exp(-x) + elementary::expm1(0.1 * x) +
           elementary::log(x) + elementary::tanh(0.3 * x) + elementary::power(x, 0.7);
  }
  EXPECT_EQ(sum, 0x1.d403cfe233216p+15);
}

}  // namespace
}  // namespace upright
