#include "adequacy.hpp"

#include <algorithm>
#include <sstream>

#include "plausibility.hpp"

namespace upright {

ResidualTests examine_fit(const FitData& data, const FitPoint& fitted, const SelectionPolicy& policy,
                          const SearchBudget& budget) {
  const Innovations innovations(data, fitted, policy);
  ResidualTests tests;
  tests.statistics = innovations.measured();
  FitPoint point = fitted;
  point.noise = sensors_only(fitted.noise);
  const FitResult plain = fit_initial_states(data, point);
  tests.noise_ratio = whitened_rms(plain);
  if (is_beyond_sensors(tests, policy))
    tests.p_values = residual_p_values(innovations, tests.statistics, policy);
  point = plain.point;
  point.noise = low_frequency_equivalent(fitted.noise, tests);
  tests.excess = tests.noise_ratio / simulation_floor(data, point, budget.floor_draws).highest;
  conclude_tests(tests, policy);
  return tests;
}

SimulationFloor held_out_floor(const Search& search, const Hypothesis& judged, const Noise& noise,
                               const ResidualTests& tests) {
  if (search.held_data().segments.empty()) return {};
  FitPoint point = judged.held.point;
  point.noise = low_frequency_equivalent(noise, tests);
  return simulation_floor(search.held_data(), point, search.budget().floor_draws);
}

void compare_held_out(const Search& search, const Hypothesis& judged, const Noise& noise,
                      ResidualTests& tests) {
  if (search.held_data().segments.empty()) return;
  Hypothesis conditioned = search.conditioned_on_held_out(judged);
  // What is left need not be such noise: all runs together may be further off than such noise makes them, and
  // held-out ones by as much again.
  const double excess =
      search.simulate(conditioned).gap / held_out_floor(search, conditioned, noise, tests).highest;
  if (!is_held_out_too_far_off(excess, tests.excess, search.policy().significance)) return;
  tests.structured = true;
  std::ostringstream text;
  text.precision(3);
  text << "a plain simulation of held-out runs is " << excess
       << " times as far off as noise like what is left of the others makes it at most";
  tests.sentence = text.str();
}

}  // namespace upright
