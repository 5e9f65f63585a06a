#include "diagnosis/tails.hpp"

#include <gtest/gtest.h>

#include <random>

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

}  // namespace
}  // namespace upright
