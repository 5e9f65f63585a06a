#include "residual_test_table.hpp"

#include <algorithm>
#include <array>
#include <sstream>

namespace upright {

namespace {

/// Words and numbers, these with three digits.
template <class... Parts>
std::string text(const Parts&... parts) {
  std::ostringstream stream;
  stream.precision(3);
  (stream << ... << parts);
  return stream.str();
}

double dependence(const ResidualTests& s) {
  return s.certainty;
}
double dispersion(const ResidualTests& s) {
  return s.dispersion;
}
double kurtosis(const ResidualTests& s) {
  return s.tails.kurtosis;
}
double tails_certainty(const ResidualTests& s) {
  return s.tails.certainty;
}
double slow(const ResidualTests& s) {
  return std::max(s.slow_force, s.slow_torque);
}
double quick(const ResidualTests& s) {
  return s.quick;
}
double excess(const ResidualTests& s) {
  return s.excess;
}

std::string slow_push_of(const ResidualTests& s) {
  const bool torque = s.slow_torque > s.slow_force;
  return text("over a tenth of a second the ", torque ? "torque on the pendulum" : "force on the cart",
              " is ", torque ? s.slow_torque : s.slow_force,
              " times as large as noise that accounts for single samples makes it");
}

std::string depends_on(const ResidualTests& s) {
  return text("what is left goes with ", s.depends_on, " (", s.certainty, " standard errors)");
}
std::string comes_in_bursts(const ResidualTests& s) {
  return text("what is left comes in bursts: some stretches are ", s.dispersion, " times as far off as most");
}
std::string has_heavy_tails(const ResidualTests& s) {
  return text("what is left comes in bursts: short pulses of force have a kurtosis of ", s.tails.kurtosis,
              ", chance gives 3 (largest blocks ", s.dispersion, " times the median, dependence ",
              s.certainty, " standard errors)");
}
std::string comes_in_bursts_that_last(const ResidualTests& s) {
  return text("what is left comes in bursts that last: ", slow_push_of(s), ", with a kurtosis of ",
              s.tails.kurtosis, ", chance gives 3");
}
std::string is_too_slow(const ResidualTests& s) {
  return text("what is left is too slow for noise: ", slow_push_of(s));
}
std::string is_too_quick(const ResidualTests& s) {
  return text(
      "what is left is too quick for a force: over a tenth of a second it is ", s.quick,
      " times as large as noise that accounts for single samples makes it, so it is in what the sensors"
      " show");
}
std::string simulates_too_far_off(const ResidualTests& s) {
  return text("a plain simulation is ", s.excess,
              " times as far off as noise like what is left makes it at most (dependence ", s.certainty,
              " standard errors)");
}
std::string is_uneven(const ResidualTests& s) {
  return text("what is left is uneven (some stretches are ", s.dispersion,
              " times as far off as most) and may go with ", s.depends_on, " (", s.certainty,
              " standard errors)");
}
std::string is_a_disturbance(const ResidualTests& s) {
  return text(
      "what is left is a disturbance that is the same all along and goes with nothing that was measured "
      "(largest "
      "blocks ",
      s.dispersion, " times the median, kurtosis of pulses ", s.tails.kurtosis, ", dependence ", s.certainty,
      " standard errors, simulation ", s.excess,
      " times as far off as such noise makes it at most, slow pushes ", slow(s), " times, ", s.quick,
      " at least)");
}

using P = ResidualPolicy;
constexpr auto above = ResidualCondition::Beyond::above, below = ResidualCondition::Beyond::below;

constexpr std::array table = {
    ResidualTest{"dependence", {dependence, above, &P::min_dependence}, {}, depends_on},
    ResidualTest{"bursts", {dispersion, above, &P::bursts}, {}, comes_in_bursts},
    ResidualTest{"heavy_tails",
                 {kurtosis, above, &P::heaviest_tails},
                 ResidualCondition{tails_certainty, above, &P::min_dependence},
                 has_heavy_tails},
    ResidualTest{"lasting_bursts",
                 {kurtosis, above, &P::heavy_tails},
                 ResidualCondition{slow, above, &P::rather_slow},
                 comes_in_bursts_that_last},
    ResidualTest{"too_slow", {slow, above, &P::slowest}, {}, is_too_slow},
    ResidualTest{"too_quick", {quick, below, &P::quickest}, {}, is_too_quick},
    ResidualTest{"rather_quick_with_dependence",
                 {quick, below, &P::rather_quick},
                 ResidualCondition{dependence, above, &P::suspected_dependence},
                 is_too_quick},
    ResidualTest{"excess", {excess, above, &P::max_excess}, {}, simulates_too_far_off},
    ResidualTest{"uneven_with_dependence",
                 {dispersion, above, &P::uneven},
                 ResidualCondition{dependence, above, &P::suspected_dependence},
                 is_uneven}};

}  // namespace

bool ResidualCondition::shows(const ResidualTests& tests, const ResidualPolicy& policy) const {
  const double value = statistic(tests);
  return beyond == Beyond::above ? value > policy.*threshold : value < policy.*threshold;
}

bool ResidualTest::fails(const ResidualTests& tests, const ResidualPolicy& policy) const {
  return sign.shows(tests, policy) && (!second || second->shows(tests, policy));
}

std::span<const ResidualTest> residual_test_table() {
  return table;
}

const ResidualTest* failed_test(const ResidualTests& tests, const ResidualPolicy& policy) {
  const auto failed = std::find_if(table.begin(), table.end(),
                                   [&](const ResidualTest& test) { return test.fails(tests, policy); });
  return failed != table.end() ? &*failed : nullptr;
}

void conclude_tests(ResidualTests& tests, const ResidualPolicy& policy) {
  tests.beyond_sensors = tests.noise_ratio > policy.sensors_noise_ratio;
  if (!tests.beyond_sensors) {
    tests.sentence = "what is left is the sensors' own noise";
    return;
  }
  const ResidualTest* failed = failed_test(tests, policy);
  tests.structured = tests.structured || failed != nullptr;
  tests.sentence = failed != nullptr ? failed->sentence(tests) : is_a_disturbance(tests);
}

}  // namespace upright
