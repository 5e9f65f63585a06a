// Is what is left noise, or something that is not in the model? Noise that no model needs to explain is the
// same all along and goes with nothing. Statistics of the innovations are compared with those of innovations
// that are drawn from the fitted model (a parametric bootstrap):
// - dependence: no force that the registry lacks shows, nor does a shift of a sensor;
// - dispersion: the innovations of short blocks are as large everywhere as chance allows. (Here and in the
//   tails, they may grow with the speed, and what dry friction holds does not count.)
// - tails: short pulses of force or torque have no heavier tails than those of a Gaussian, nor has the slow
//   disturbance that a filter with a memory estimates;
// - colour: over a tenth of a second and more force and torque are not much larger than as white noise, nor
//   much smaller.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "innovation_statistics.hpp"
#include "selection_policy.hpp"
#include "upright/diagnosis/diagnosis.hpp"

namespace upright {

struct ResidualTests {
  double noise_ratio = 1.0;  ///< rms of a plain simulation's residual over the sensors' noise
  double excess = 1.0;       ///< the same over what noise like what is left makes of it at most
  InnovationStatistics statistics;
  /// Of each test in the table; empty: no statistic is beyond its limit, so none were computed.
  std::vector<double> p_values;
  bool beyond_sensors = false;  ///< it is more than the sensors' own noise
  bool structured = false;      ///< and more than a disturbance: something is missing
  std::string sentence;
};

/// One statistic of the innovations. Something is missing where it is beyond its limit and chance does not
/// make it so.
struct ResidualTest {
  enum class Beyond { above, below };
  std::string_view name;
  double (*statistic)(const InnovationStatistics&);
  Beyond beyond;
  double (*limit)(const SelectionPolicy&);
  std::string (*sentence)(const InnovationStatistics&);

  /// Whether the first of two values is as far in the direction of the limit as the second, or further.
  bool is_as_extreme(double value, double as) const;
  bool is_beyond(const InnovationStatistics& statistics, const SelectionPolicy& policy) const;
};

/// In the order in which they are asked: the first that fails says what is left.
std::span<const ResidualTest> residual_test_table();

/// The p-value of each test, by draws from the fitted model. The draws end early where no test that is beyond
/// its limit can become significant. NaN: the data do not show the statistic. Empty: none is beyond its
/// limit.
std::vector<double> residual_p_values(const Innovations& innovations, const InnovationStatistics& measured,
                                      const SelectionPolicy& policy);

/// Which of several hypotheses are rejected at a level for all of them together; NaN: there is no hypothesis.
/// S. Holm, Scandinavian Journal of Statistics 6 (1979) 65.
std::vector<bool> rejected_by_holm(const std::vector<double>& p_values, double level);

/// Which tests of the table fail.
std::vector<bool> failed_tests(const ResidualTests& tests, const SelectionPolicy& policy);

/// The first test that fails; null where none does.
const ResidualTest* failed_test(const ResidualTests& tests, const SelectionPolicy& policy);

/// Whether what is left is more than the sensors' own noise; within that, nothing is tested.
bool is_beyond_sensors(const ResidualTests& tests, const SelectionPolicy& policy);

/// Whether what is left is more than noise, in a sentence, once p-values and excess are known.
void conclude_tests(ResidualTests& tests, const SelectionPolicy& policy);

/// The tests as they are reported; empty within the sensors' own noise.
std::vector<ResidualStatistic> reported_tests(const ResidualTests& tests, const SelectionPolicy& policy);

/// White noise that moves a plain simulation as what is left does.
Noise low_frequency_equivalent(Noise noise, const ResidualTests& tests);

}  // namespace upright
