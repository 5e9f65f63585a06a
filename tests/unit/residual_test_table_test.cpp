// Both sides of every test of what a fit leaves.
#include "diagnosis/residual_test_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "diagnosis/plain_words.hpp"

namespace upright {
namespace {

constexpr ResidualPolicy policy;

/// Beyond the sensors' noise, and like white noise in every other way.
ResidualTests disturbed() {
  ResidualTests left;
  left.noise_ratio = 10.0;
  return left;
}

std::string failed_id(const ResidualTests& left) {
  const ResidualTest* failed = failed_test(left, policy);
  return failed != nullptr ? std::string(failed->id) : "";
}

/// One statistic at a threshold, with the others as the test needs them.
struct Threshold {
  const char* id;
  const char* statistic;
  void (*set)(ResidualTests&, double);
  double value;
  int direction;  ///< 1: fails above, -1: fails below
};

const Threshold thresholds[] = {
    {"dependence", "certainty", [](ResidualTests& s, double v) { s.certainty = v; }, policy.min_dependence,
     1},
    {"bursts", "dispersion", [](ResidualTests& s, double v) { s.dispersion = v; }, policy.bursts, 1},
    {"heavy_tails", "kurtosis",
     [](ResidualTests& s, double v) {
       s.tails = {v, 4.0};
     },
     policy.heaviest_tails, 1},
    {"heavy_tails", "certainty",
     [](ResidualTests& s, double v) {
       s.tails = {6.0, v};
     },
     policy.min_dependence, 1},
    {"lasting_bursts", "kurtosis",
     [](ResidualTests& s, double v) {
       s.tails.kurtosis = v;
       s.slow_force = 2.0;
     },
     policy.heavy_tails, 1},
    {"lasting_bursts", "slow torque",
     [](ResidualTests& s, double v) {
       s.tails.kurtosis = 5.2;
       s.slow_torque = v;
     },
     policy.rather_slow, 1},
    {"too_slow", "slow force", [](ResidualTests& s, double v) { s.slow_force = v; }, policy.slowest, 1},
    {"too_slow", "slow torque", [](ResidualTests& s, double v) { s.slow_torque = v; }, policy.slowest, 1},
    {"too_quick", "quick", [](ResidualTests& s, double v) { s.quick = v; }, policy.quickest, -1},
    {"rather_quick_with_dependence", "quick",
     [](ResidualTests& s, double v) {
       s.quick = v;
       s.certainty = 3.0;
     },
     policy.rather_quick, -1},
    {"rather_quick_with_dependence", "certainty",
     [](ResidualTests& s, double v) {
       s.quick = 0.7;
       s.certainty = v;
     },
     policy.suspected_dependence, 1},
    {"excess", "excess", [](ResidualTests& s, double v) { s.excess = v; }, policy.max_excess, 1},
    {"uneven_with_dependence", "dispersion",
     [](ResidualTests& s, double v) {
       s.dispersion = v;
       s.certainty = 3.0;
     },
     policy.uneven, 1},
    {"uneven_with_dependence", "certainty",
     [](ResidualTests& s, double v) {
       s.dispersion = 1.5;
       s.certainty = v;
     },
     policy.suspected_dependence, 1},
};

TEST(ResidualTestTable, EachTestFailsJustBeyondItsThresholdOnly) {
  for (const Threshold& t : thresholds) {
    ResidualTests at = disturbed(), beyond = disturbed();
    t.set(at, t.value);
    t.set(beyond, std::nextafter(t.value, t.direction * std::numeric_limits<double>::infinity()));
    EXPECT_EQ(failed_id(at), "") << t.id << ", " << t.statistic;
    EXPECT_EQ(failed_id(beyond), t.id) << t.statistic;
    conclude_tests(at, policy);
    conclude_tests(beyond, policy);
    EXPECT_FALSE(at.structured) << t.id;
    EXPECT_TRUE(beyond.structured) << t.id;
    EXPECT_NE(at.sentence, beyond.sentence) << t.id;
  }
}

TEST(ResidualTestTable, EveryTestOfItIsHeldOnBothSides) {
  std::set<std::string> held;
  for (const Threshold& t : thresholds) held.insert(t.id);
  for (const ResidualTest& test : residual_test_table())
    EXPECT_TRUE(held.contains(std::string(test.id))) << test.id;
}

TEST(ResidualTestTable, NothingIsTestedWithinTheSensorsNoise) {
  ResidualTests left = disturbed();
  left.certainty = 100.0;
  left.noise_ratio = policy.sensors_noise_ratio;
  conclude_tests(left, policy);
  EXPECT_FALSE(left.beyond_sensors);
  EXPECT_FALSE(left.structured);
  left.noise_ratio = std::nextafter(policy.sensors_noise_ratio, 2.0);
  conclude_tests(left, policy);
  EXPECT_TRUE(left.beyond_sensors);
  EXPECT_TRUE(left.structured);
}

TEST(PlainWords, ReplaceTheFixedPhrasesOfEveryTest) {
  ResidualTests left = disturbed();
  left.depends_on = "speed of the cart";
  left.certainty = 4.5;
  for (const ResidualTest& test : residual_test_table()) {
    const std::string read = in_plain_words(test.sentence(left));
    for (const FixedPhrase& phrase : fixed_phrases)
      EXPECT_EQ(read.find(phrase.fixed), std::string::npos) << test.id << ": " << read;
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
