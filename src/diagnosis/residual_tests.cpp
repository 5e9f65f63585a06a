#include "residual_tests.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>

#include "base/parallel.hpp"

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

using Statistics = InnovationStatistics;

double largest_dependence(const Statistics& s) {
  return s.largest_dependence();
}
double dispersion(const Statistics& s) {
  return s.dispersion;
}
template <std::size_t Pulse>
double kurtosis(const Statistics& s) {
  return s.kurtosis[Pulse];
}
template <std::size_t Disturbance>
double disturbance_kurtosis(const Statistics& s) {
  return s.disturbance_kurtosis[Disturbance];
}
template <std::size_t Pulse>
double pulse_size(const Statistics& s) {
  return s.pulse_size[Pulse];
}

constexpr std::array pulse_names = {"force on the cart", "torque on the pendulum"};

std::string depends_on(const Statistics& s) {
  const std::size_t most = s.named_probe;
  return text("what is left goes with ", name_of_residual_probe(most, s.is_positive[most]), " (",
              s.dependence[most], " standard errors)");
}
std::string comes_in_bursts(const Statistics& s) {
  return text("what is left comes in bursts: some stretches are ", s.dispersion, " times as far off as most");
}
template <std::size_t Pulse>
std::string has_heavy_tails(const Statistics& s) {
  return text("what is left comes in bursts: short pulses of ", Pulse == 0 ? "force" : "torque",
              " have a kurtosis of ", s.kurtosis[Pulse], ", chance gives 3");
}
template <std::size_t Disturbance>
std::string comes_and_goes(const Statistics& s) {
  return text("what is left comes in bursts: a slow ", Disturbance == 0 ? "force" : "torque",
              " has a kurtosis of ", s.disturbance_kurtosis[Disturbance], ", chance gives 3");
}
template <std::size_t Pulse>
std::string is_too_slow(const Statistics& s) {
  return text("what is left is too slow for noise: over a tenth of a second the ", pulse_names[Pulse], " is ",
              s.pulse_size[Pulse], " times as large as noise that accounts for single samples makes it");
}
template <std::size_t Pulse>
std::string is_too_quick(const Statistics& s) {
  return text("what is left is too quick for a force: over a tenth of a second the ", pulse_names[Pulse],
              " is ", s.pulse_size[Pulse],
              " times as large as noise that accounts for single samples makes it, so it is in what the "
              "sensors show");
}
bool is_excessive(const ResidualTests& tests, const SelectionPolicy& policy) {
  return tests.excess > policy.significance.clear_ratio;
}
std::string simulates_too_far_off(const ResidualTests& tests) {
  return text("a plain simulation is ", tests.excess,
              " times as far off as noise like what is left makes it at most");
}
/// Of those that are numbers.
std::string range_of(const std::array<double, 2>& values) {
  const double low = std::fmin(values[0], values[1]), high = std::fmax(values[0], values[1]);
  return std::isnan(low) ? "not seen" : low == high ? text(low) : text(low, " to ", high);
}
std::string is_a_disturbance(const ResidualTests& tests) {
  const Statistics& s = tests.statistics;
  return text(
      "what is left is a disturbance that is the same all along and goes with nothing that was measured "
      "(largest blocks ",
      s.dispersion, " times the median, kurtosis of pulses ", range_of(s.kurtosis), ", size of pulses ",
      range_of(s.pulse_size), ", dependence ", s.largest_dependence(), " standard errors, simulation ",
      tests.excess, " times as far off as such noise makes it at most)");
}

double min_dependence(const SelectionPolicy& policy) {
  return policy.significance.noticeable_z;
}
double clearly_larger(const SelectionPolicy& policy) {
  return policy.significance.clear_ratio;
}
double clearly_smaller(const SelectionPolicy& policy) {
  return 1.0 / policy.significance.clear_ratio;
}
template <double AdequacyPolicy::*Limit>
double limit(const SelectionPolicy& policy) {
  return policy.adequacy.*Limit;
}

using P = AdequacyPolicy;
constexpr auto above = ResidualTest::Beyond::above, below = ResidualTest::Beyond::below;

constexpr std::array table = {
    ResidualTest{"dependence on motion, voltage or time", largest_dependence, above, min_dependence,
                 depends_on},
    ResidualTest{"dispersion of blocks", dispersion, above, limit<&P::min_dispersion>, comes_in_bursts},
    ResidualTest{"kurtosis of pulses of force", kurtosis<0>, above, limit<&P::min_kurtosis>,
                 has_heavy_tails<0>},
    ResidualTest{"kurtosis of pulses of torque", kurtosis<1>, above, limit<&P::min_kurtosis>,
                 has_heavy_tails<1>},
    ResidualTest{"kurtosis of slow force", disturbance_kurtosis<0>, above, limit<&P::min_kurtosis>,
                 comes_and_goes<0>},
    ResidualTest{"kurtosis of slow torque", disturbance_kurtosis<1>, above, limit<&P::min_kurtosis>,
                 comes_and_goes<1>},
    ResidualTest{"size of slow force, too large", pulse_size<0>, above, clearly_larger, is_too_slow<0>},
    ResidualTest{"size of slow torque, too large", pulse_size<1>, above, clearly_larger, is_too_slow<1>},
    ResidualTest{"size of slow force, too small", pulse_size<0>, below, clearly_smaller, is_too_quick<0>},
    ResidualTest{"size of slow torque, too small", pulse_size<1>, below, clearly_smaller, is_too_quick<1>}};

/// For each test that the data allow, how many draws are as extreme as what was measured.
class Exceedances {
 public:
  explicit Exceedances(const InnovationStatistics& measured)
      : measured_(measured), counts_(table.size(), 0) {}

  void add(const std::vector<InnovationStatistics>& draws) {
    for (const InnovationStatistics& draw : draws)
      for (std::size_t i = 0; i < table.size(); ++i)
        if (table[i].is_as_extreme(table[i].statistic(draw), table[i].statistic(measured_))) ++counts_[i];
    draws_ += draws.size();
  }
  bool may_be_significant(std::size_t test, const SelectionPolicy& policy) const {
    return static_cast<double>(counts_[test] + 1) <=
           policy.significance.level * static_cast<double>(policy.residual.draws + 1);
  }
  std::vector<double> p_values() const {
    std::vector<double> values;
    for (std::size_t i = 0; i < table.size(); ++i)
      values.push_back(std::isnan(table[i].statistic(measured_))
                           ? std::numeric_limits<double>::quiet_NaN()
                           : static_cast<double>(counts_[i] + 1) / static_cast<double>(draws_ + 1));
    return values;
  }

 private:
  const InnovationStatistics& measured_;
  std::vector<std::size_t> counts_;
  std::size_t draws_ = 0;
};

}  // namespace

bool ResidualTest::is_as_extreme(double value, double as) const {
  return beyond == Beyond::above ? value >= as : value <= as;
}

bool ResidualTest::is_beyond(const InnovationStatistics& statistics, const SelectionPolicy& policy) const {
  const double value = statistic(statistics);
  return beyond == Beyond::above ? value > limit(policy) : value < limit(policy);
}

std::span<const ResidualTest> residual_test_table() {
  return table;
}

std::vector<double> residual_p_values(const Innovations& innovations, const InnovationStatistics& measured,
                                      const SelectionPolicy& policy) {
  std::vector<std::size_t> beyond;
  for (std::size_t i = 0; i < table.size(); ++i)
    if (table[i].is_beyond(measured, policy)) beyond.push_back(i);
  if (beyond.empty()) return {};
  constexpr std::size_t batch = 100;
  Exceedances exceedances(measured);
  for (std::size_t done = 0; done < policy.residual.draws; done += batch) {
    std::vector<InnovationStatistics> draws(std::min(batch, policy.residual.draws - done));
    parallel_for(draws.size(), [&](std::size_t i) { draws[i] = innovations.drawn(done + i + 1); });
    exceedances.add(draws);
    if (std::none_of(beyond.begin(), beyond.end(),
                     [&](std::size_t i) { return exceedances.may_be_significant(i, policy); }))
      break;
  }
  return exceedances.p_values();
}

std::vector<bool> rejected_by_holm(const std::vector<double>& p_values, double level) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < p_values.size(); ++i)
    if (!std::isnan(p_values[i])) order.push_back(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return p_values[a] < p_values[b]; });
  std::vector<bool> rejected(p_values.size(), false);
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (p_values[order[i]] > level / static_cast<double>(order.size() - i)) break;
    rejected[order[i]] = true;
  }
  return rejected;
}

std::vector<bool> failed_tests(const ResidualTests& tests, const SelectionPolicy& policy) {
  std::vector<bool> failed = rejected_by_holm(tests.p_values, policy.significance.level);
  failed.resize(table.size(), false);
  for (std::size_t i = 0; i < table.size(); ++i)
    failed[i] = failed[i] && table[i].is_beyond(tests.statistics, policy);
  return failed;
}

const ResidualTest* failed_test(const ResidualTests& tests, const SelectionPolicy& policy) {
  const std::vector<bool> failed = failed_tests(tests, policy);
  const auto first = std::find(failed.begin(), failed.end(), true);
  return first != failed.end() ? &table[static_cast<std::size_t>(first - failed.begin())] : nullptr;
}

std::vector<ResidualStatistic> reported_tests(const ResidualTests& tests, const SelectionPolicy& policy) {
  if (!tests.beyond_sensors) return {};
  const std::vector<bool> failed = failed_tests(tests, policy);
  std::vector<ResidualStatistic> reported;
  for (std::size_t i = 0; i < table.size(); ++i) {
    ResidualStatistic statistic;
    statistic.name = table[i].name;
    statistic.value = table[i].statistic(tests.statistics);
    statistic.limit = table[i].limit(policy);
    statistic.counts_above = table[i].beyond == above;
    if (!tests.p_values.empty()) statistic.p_value = tests.p_values[i];
    statistic.fails = failed[i];
    reported.push_back(statistic);
  }
  reported.push_back({"error of an open-loop simulation",
                      tests.excess,
                      policy.significance.clear_ratio,
                      true,
                      {},
                      is_excessive(tests, policy)});
  return reported;
}

bool is_beyond_sensors(const ResidualTests& tests, const SelectionPolicy& policy) {
  return tests.noise_ratio > std::exp(policy.significance.visible_change);
}

void conclude_tests(ResidualTests& tests, const SelectionPolicy& policy) {
  tests.beyond_sensors = is_beyond_sensors(tests, policy);
  if (!tests.beyond_sensors) {
    tests.sentence = "what is left is the sensors' own noise";
    return;
  }
  if (const ResidualTest* failed = failed_test(tests, policy)) {
    tests.structured = true;
    tests.sentence = failed->sentence(tests.statistics);
  } else if (is_excessive(tests, policy)) {
    tests.structured = true;
    tests.sentence = simulates_too_far_off(tests);
  } else {
    tests.sentence = is_a_disturbance(tests);
  }
}

Noise low_frequency_equivalent(Noise noise, const ResidualTests& tests) {
  // A disturbance whose colour the filter does not know is estimated where the samples show it best, and a
  // plain simulation is moved by what is slow. Where no pulses show it, the noise stays.
  const double slow_force = std::fmax(1.0, tests.statistics.pulse_size[0]);
  const double slow_torque = std::fmax(1.0, tests.statistics.pulse_size[1]);
  noise.force *= slow_force;
  noise.coloured_force_n *= slow_force;
  noise.torque *= slow_torque;
  noise.coloured_torque_nm *= slow_torque;
  return noise;
}

}  // namespace upright
