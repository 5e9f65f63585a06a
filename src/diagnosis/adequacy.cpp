#include "adequacy.hpp"

#include <algorithm>
#include <sstream>

#include "plausibility.hpp"
#include "residual_test_table.hpp"

namespace upright {

ResidualTests examine_fit(const FitData& data, const FitPoint& fitted, const SelectionPolicy& policy,
                          const SearchBudget& budget) {
  ResidualTests structure = examine_residuals(data, fitted, policy);
  FitPoint point = fitted;
  point.noise = sensors_only(fitted.noise);
  const FitResult plain = fit_initial_states(data, point);
  structure.noise_ratio = whitened_rms(plain);
  point = plain.point;
  point.noise = as_slow_as_left(fitted.noise, structure);
  structure.excess = structure.noise_ratio / simulation_floor(data, point, budget.floor_draws).highest;
  conclude_tests(structure, policy.residual);
  return structure;
}

SimulationFloor held_out_floor(const Search& search, const Hypothesis& judged,
                               const ResidualTests& structure) {
  if (search.held_data().segments.empty()) return {};
  FitPoint point = judged.held.point;
  point.noise = as_slow_as_left(judged.train.point.noise, structure);
  return simulation_floor(search.held_data(), point, search.budget().floor_draws);
}

void compare_held_out(const Search& search, const Hypothesis& judged, ResidualTests& structure) {
  if (search.held_data().segments.empty()) return;
  Hypothesis told = search.told(judged);
  // What is left need not be such noise: all runs together may be further off than such noise makes them, and
  // held-out ones by as much again.
  const double excess = search.simulate(told).gap / held_out_floor(search, told, structure).highest;
  if (!is_held_out_too_far_off(excess, structure.excess, search.policy().residual)) return;
  structure.structured = true;
  std::ostringstream text;
  text.precision(3);
  text << "a plain simulation of held-out runs is " << excess
       << " times as far off as noise like what is left of the others makes it at most";
  structure.sentence = text.str();
}

}  // namespace upright
