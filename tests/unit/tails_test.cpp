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

// The certainty is a Gaussian variable: chance passes two standard errors in one sample of some forty.
TEST(Tails, ChanceIsAsRareAsItSays) {
  std::mt19937_64 random(5);
  for (const std::size_t count : {40u, 150u, 600u}) {
    constexpr int samples = 4000;
    int beyond_two = 0, beyond_four = 0;
    for (int i = 0; i < samples; ++i) {
      const double certainty = tails_of(gaussian(count, random)).certainty;
      beyond_two += certainty > 2.0 ? 1 : 0;
      beyond_four += certainty > 4.0 ? 1 : 0;
    }
    EXPECT_GT(beyond_two, samples / 150) << count;
    EXPECT_LT(beyond_two, samples / 25) << count;
    EXPECT_LT(beyond_four, samples / 500) << count;
  }
}

TEST(Tails, BurstsAreCertain) {
  std::mt19937_64 random(7);
  std::vector<double> values = gaussian(60, random);
  values[10] = 9.0;
  values[11] = -7.0;
  const Tails tails = tails_of(values);
  EXPECT_GT(tails.kurtosis, 10.0);
  EXPECT_GT(tails.certainty, 4.0);
}

TEST(Tails, LightTailsAndSmallNumbersAreNot) {
  std::vector<double> even;
  for (int i = 0; i < 100; ++i) even.push_back(i % 2 == 0 ? 1.5 : -1.5);
  EXPECT_NEAR(tails_of(even).kurtosis, 1.0, 1e-12);
  EXPECT_EQ(tails_of(even).certainty, 0.0);
  std::vector<double> quiet(100, 0.01);
  quiet[50] = 1.0;
  EXPECT_EQ(tails_of(quiet).certainty, 0.0);
  EXPECT_EQ(tails_of({}).certainty, 0.0);
  EXPECT_EQ(tails_of(std::vector<double>(29, 5.0)).certainty, 0.0);
}

}  // namespace
}  // namespace upright
