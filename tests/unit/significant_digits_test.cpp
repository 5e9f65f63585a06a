// Fitted numbers without the digits that the data do not determine.
#include "estimation/significant_digits.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "upright/model/registry.hpp"

namespace upright {
namespace {

TEST(SignificantDigits, LastDigitIsAHundredthOfTheErrorAtMost) {
  EXPECT_EQ(rounded_to_significant_digits(0.5999726319768507, 7e-5), 0.5999726);
  EXPECT_EQ(rounded_to_significant_digits(-123456.789, 3000.0), -123460.0);
  EXPECT_EQ(rounded_to_significant_digits(2.5014371e-9, 1e-11), 2.5014e-9);
  EXPECT_EQ(rounded_to_significant_digits(0.0, 1.0), 0.0);
}

TEST(SignificantDigits, AValueOfUnknownErrorStays) {
  constexpr double value = 0.1234567890123;
  for (const double error : {0.0, -1.0, std::numeric_limits<double>::infinity(),
                             std::numeric_limits<double>::quiet_NaN(), 1e-30, 1e30})
    EXPECT_EQ(rounded_to_significant_digits(value, error), value);
}

TEST(SignificantDigits, RandomValuesMoveByHalfAHundredthAtMost) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> exponent(-12.0, 12.0), factor(-1.0, 1.0);
  for (int i = 0; i < 10000; ++i) {
    const double error = std::pow(10.0, exponent(random));
    const double value = 1e4 * error * factor(random);
    const double rounded = rounded_to_significant_digits(value, error);
    EXPECT_LE(std::abs(rounded - value), 0.00501 * error);
    EXPECT_EQ(rounded_to_significant_digits(rounded, error), rounded);
  }
}

TEST(SignificantDigits, LastBitsOfAFitDoNotReachTheModel) {
  const std::size_t coulomb = effect_number("coulomb_friction");
  FreeParameter p;
  p.effect = coulomb;
  p.high = 10.0;
  FitResult one, other;
  one.information = other.information = Eigen::MatrixXd::Constant(1, 1, 1e4);
  one.point.plant.set("coulomb_friction", {0.61234567890123});
  other.point.plant.set("coulomb_friction", {0.61234567890987});
  round_to_significant_digits(one, {p});
  round_to_significant_digits(other, {p});
  EXPECT_EQ(one.point.plant.find(coulomb)->values[0], other.point.plant.find(coulomb)->values[0]);
}

TEST(SignificantDigits, AValueAtABoundStaysThere) {
  const std::size_t coulomb = effect_number("coulomb_friction");
  FreeParameter p;
  p.effect = coulomb;
  p.low = 0.123456789;
  p.high = 0.987654321;
  FitResult fitted;
  fitted.information = Eigen::MatrixXd::Constant(1, 1, 1.0);
  for (const double value : {p.low, p.high}) {
    fitted.point.plant.set("coulomb_friction", {value});
    round_to_significant_digits(fitted, {p});
    EXPECT_EQ(fitted.point.plant.find(coulomb)->values[0], value);
  }
  fitted.point.plant.set("coulomb_friction", {0.124});
  fitted.information(0, 0) = 1e-4;
  round_to_significant_digits(fitted, {p});
  EXPECT_EQ(fitted.point.plant.find(coulomb)->values[0], p.low);
}

}  // namespace
}  // namespace upright
