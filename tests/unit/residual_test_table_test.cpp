// Both sides of every test of what a fit leaves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "diagnosis/plain_words.hpp"
#include "diagnosis/residual_tests.hpp"

namespace upright {
namespace {

constexpr SelectionPolicy policy;
const double smallest_p_value = 1.0 / (static_cast<double>(policy.residual.draws) + 1.0);

/// Beyond the sensors' noise, and like white noise in every other way.
ResidualTests disturbed() {
  ResidualTests left;
  left.noise_ratio = 10.0;
  left.statistics.kurtosis = {3.0, 3.0};
  left.statistics.pulse_size = {1.0, 1.0};
  left.p_values.assign(residual_test_table().size(), smallest_p_value);
  return left;
}

std::string failed_name(const ResidualTests& left) {
  const ResidualTest* failed = failed_test(left, policy);
  return failed != nullptr ? std::string(failed->name) : "";
}

struct Limit {
  const char* name;
  void (*set)(InnovationStatistics&, double);
  double value;
  int direction;  ///< 1: fails above, -1: fails below
};

const Limit limits[] = {
    {"dependence on motion, voltage or time", [](InnovationStatistics& s, double v) { s.dependence[3] = v; },
     policy.significance.noticeable_z, 1},
    {"dispersion of blocks", [](InnovationStatistics& s, double v) { s.dispersion = v; },
     policy.adequacy.min_dispersion, 1},
    {"kurtosis of pulses of force", [](InnovationStatistics& s, double v) { s.kurtosis[0] = v; },
     policy.adequacy.min_kurtosis, 1},
    {"kurtosis of pulses of torque", [](InnovationStatistics& s, double v) { s.kurtosis[1] = v; },
     policy.adequacy.min_kurtosis, 1},
    {"kurtosis of slow force", [](InnovationStatistics& s, double v) { s.disturbance_kurtosis[0] = v; },
     policy.adequacy.min_kurtosis, 1},
    {"kurtosis of slow torque", [](InnovationStatistics& s, double v) { s.disturbance_kurtosis[1] = v; },
     policy.adequacy.min_kurtosis, 1},
    {"size of slow force, too large", [](InnovationStatistics& s, double v) { s.pulse_size[0] = v; },
     policy.significance.clear_ratio, 1},
    {"size of slow torque, too large", [](InnovationStatistics& s, double v) { s.pulse_size[1] = v; },
     policy.significance.clear_ratio, 1},
    {"size of slow force, too small", [](InnovationStatistics& s, double v) { s.pulse_size[0] = v; },
     1.0 / policy.significance.clear_ratio, -1},
    {"size of slow torque, too small", [](InnovationStatistics& s, double v) { s.pulse_size[1] = v; },
     1.0 / policy.significance.clear_ratio, -1},
};

TEST(ResidualTestTable, EachTestFailsJustBeyondItsLimitOnly) {
  for (const Limit& limit : limits) {
    ResidualTests at = disturbed(), beyond = disturbed();
    limit.set(at.statistics, limit.value);
    limit.set(beyond.statistics,
              std::nextafter(limit.value, limit.direction * std::numeric_limits<double>::infinity()));
    EXPECT_EQ(failed_name(at), "") << limit.name;
    EXPECT_EQ(failed_name(beyond), limit.name);
    conclude_tests(at, policy);
    conclude_tests(beyond, policy);
    EXPECT_FALSE(at.structured) << limit.name;
    EXPECT_TRUE(beyond.structured) << limit.name;
    EXPECT_NE(at.sentence, beyond.sentence) << limit.name;
  }
}

TEST(ResidualTestTable, WhatChanceMakesDoesNotFail) {
  for (std::size_t i = 0; i < residual_test_table().size(); ++i) {
    ResidualTests beyond = disturbed();
    limits[i].set(beyond.statistics, limits[i].direction > 0 ? 100.0 : 0.0);
    beyond.p_values.assign(residual_test_table().size(), 0.5);
    EXPECT_EQ(failed_name(beyond), "") << limits[i].name;
    beyond.p_values[i] = policy.significance.level / static_cast<double>(residual_test_table().size());
    EXPECT_EQ(failed_name(beyond), limits[i].name);
  }
}

TEST(ResidualTestTable, EveryTestOfItIsHeldOnBothSides) {
  std::set<std::string> held;
  for (const Limit& limit : limits) held.insert(limit.name);
  for (const ResidualTest& test : residual_test_table())
    EXPECT_TRUE(held.contains(std::string(test.name))) << test.name;
}

TEST(ResidualTestTable, ExcessFailsWithoutDraws) {
  ResidualTests left = disturbed();
  left.p_values.clear();
  left.excess = policy.significance.clear_ratio;
  conclude_tests(left, policy);
  EXPECT_FALSE(left.structured);
  left.excess = std::nextafter(policy.significance.clear_ratio, 10.0);
  conclude_tests(left, policy);
  EXPECT_TRUE(left.structured);
}

TEST(ResidualTestTable, NothingIsTestedWithinTheSensorsNoise) {
  ResidualTests left = disturbed();
  left.statistics.dispersion = 100.0;
  left.noise_ratio = std::exp(policy.significance.visible_change);
  conclude_tests(left, policy);
  EXPECT_FALSE(left.beyond_sensors);
  EXPECT_FALSE(left.structured);
  left.noise_ratio = std::nextafter(std::exp(policy.significance.visible_change), 2.0);
  conclude_tests(left, policy);
  EXPECT_TRUE(left.beyond_sensors);
  EXPECT_TRUE(left.structured);
}

TEST(Holm, RejectsInTheOrderOfThePValues) {
  // The example of level 0.05 with 0.01, 0.04, 0.03, 0.005: rejected up to the first above its share.
  EXPECT_EQ(rejected_by_holm({0.01, 0.04, 0.03, 0.005}, 0.05), (std::vector<bool>{true, false, false, true}));
  EXPECT_EQ(rejected_by_holm({0.01, 0.02, 0.02, 0.005}, 0.05), (std::vector<bool>{true, true, true, true}));
  EXPECT_TRUE(rejected_by_holm({}, 0.05).empty());
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(rejected_by_holm({none, 0.05, none}, 0.05), (std::vector<bool>{false, true, false}));
}

TEST(Holm, RejectsAnythingOfChanceAsOftenAsItsLevelSays) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform;
  constexpr int repetitions = 20000;
  constexpr double level = 0.05;
  int rejections = 0;
  for (int i = 0; i < repetitions; ++i) {
    std::vector<double> p_values(8);
    for (double& p : p_values) p = uniform(random);
    const std::vector<bool> rejected = rejected_by_holm(p_values, level);
    if (std::find(rejected.begin(), rejected.end(), true) != rejected.end()) ++rejections;
  }
  const double expected = 1.0 - std::pow(1.0 - level / 8.0, 8.0), share = rejections / double{repetitions};
  EXPECT_NEAR(share, expected, 4.0 * std::sqrt(expected / repetitions));
}

TEST(PlainWords, ReplaceTheFixedPhrasesOfEveryTest) {
  InnovationStatistics statistics = disturbed().statistics;
  statistics.dependence[0] = 4.5;
  for (const ResidualTest& test : residual_test_table()) {
    const std::string read = in_plain_words(test.sentence(statistics));
    for (const FixedPhrase& phrase : fixed_phrases)
      EXPECT_EQ(read.find(phrase.fixed), std::string::npos) << test.name << ": " << read;
  }
  EXPECT_EQ(in_plain_words("what is left goes with speed of the cart (4.5 standard errors)"),
            "the residual depends on speed of the cart (4.5 standard errors)");
  EXPECT_EQ(
      in_plain_words("a plain simulation is 3 times as far off as noise like what is left makes it at most"),
      "the error of an open-loop simulation is 3 times the largest error expected from noise like the "
      "residual");
  EXPECT_EQ(in_plain_words("nothing to replace"), "nothing to replace");
}

}  // namespace
}  // namespace upright
