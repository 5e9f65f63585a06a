#include "diagnosis/tails.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>

namespace upright {
namespace {

std::vector<double> gaussian(std::size_t count, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<double> values(count);
  for (double& v : values) v = normal(random);
  return values;
}

TEST(Kurtosis, IsThatOfTheDistribution) {
  std::mt19937_64 random(5);
  EXPECT_NEAR(kurtosis_of(gaussian(100000, random)), 3.0, 0.1);
  std::vector<double> even;
  for (int i = 0; i < 100; ++i) even.push_back(i % 2 == 0 ? 1.5 : -1.5);
  EXPECT_NEAR(kurtosis_of(even), 1.0, 1e-12);
}

TEST(Kurtosis, OfBurstsIsLarge) {
  std::mt19937_64 random(7);
  std::vector<double> values = gaussian(60, random);
  values[10] = 9.0;
  values[11] = -7.0;
  EXPECT_GT(kurtosis_of(values), 10.0);
}

TEST(Kurtosis, OfNumbersThatAreTooSmallIsNone) {
  std::vector<double> quiet(100, 0.01);
  quiet[50] = 1.0;
  EXPECT_LT(kurtosis_of(quiet), 0.1);
}

/// Gaussian numbers whose scatter grows with a speed, and the speeds.
std::pair<std::vector<double>, std::vector<double>> growing(std::size_t count, double growth) {
  std::mt19937_64 random(11);
  std::exponential_distribution<double> speed;
  std::vector<double> values = gaussian(count, random), speeds;
  speeds.reserve(count);
  for (double& v : values) {
    speeds.push_back(0.3 * speed(random));
    v *= std::sqrt(1.0 + growth * speeds.back() * speeds.back());
  }
  return {values, speeds};
}

double mean_square(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v * v;
  return sum / static_cast<double>(values.size());
}

TEST(Growth, WithSpeedIsNoHeavyTail) {
  const auto [values, speeds] = growing(2000, 100.0);
  EXPECT_GT(kurtosis_of(values), 6.0);
  EXPECT_NEAR(kurtosis_of(without_growth(values, speeds)), 3.0, 0.5);
  EXPECT_NEAR(mean_square(without_growth(values, speeds)), mean_square(values), 1e-9);
}

TEST(Growth, LeavesWhatDoesNotGoWithSpeed) {
  auto [values, speeds] = growing(200, 0.0);
  values[20] = 9.0;
  values[21] = -8.0;
  values[90] = 7.0;
  EXPECT_GT(kurtosis_of(without_growth(values, speeds)), 0.8 * kurtosis_of(values));
  EXPECT_EQ(without_growth(values, std::vector<double>(200, 0.0)), values);
}

}  // namespace
}  // namespace upright
