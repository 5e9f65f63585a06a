// How far off plain simulations are: without the corrections of the filter, from initial states that are
// fitted.
#include <algorithm>
#include <cmath>
#include <limits>

#include "search.hpp"

namespace upright {

namespace {

std::vector<double> gaps_of_segments(const FitResult& simulated) {
  std::vector<double> gaps;
  for (std::size_t s = 0; s < simulated.segment_chi_square.size(); ++s)
    gaps.push_back(std::sqrt(simulated.segment_chi_square[s] / std::max(simulated.segment_samples[s], 1e-9)));
  return gaps;
}

}  // namespace

const FreeRunSimulation& Search::simulate(Hypothesis& h) const {
  if (h.simulation) return *h.simulation;
  if (!std::isfinite(h.train.objective)) {
    // What cannot be fitted cannot be simulated: it is further off than anything that can.
    constexpr double infinite = std::numeric_limits<double>::infinity();
    const std::size_t segments = held_.segments.empty() ? train_.segments.size() : held_.segments.size();
    h.simulation.emplace(FreeRunSimulation{infinite, std::vector<double>(segments, infinite)});
    return *h.simulation;
  }
  Hypothesis plain = h;
  filter_held_out(plain, sensors_only(h.train.point.noise));
  const FitResult& simulated = held_.segments.empty() ? plain.train : plain.held;
  h.simulation.emplace(FreeRunSimulation{gap_of(plain), gaps_of_segments(simulated)});
  return *h.simulation;
}

const std::vector<double>& Search::simulate_training(Hypothesis& h) const {
  if (h.training_segment_gap.empty()) {
    FitPoint point = h.train.point;
    point.noise = sensors_only(point.noise);
    h.training_segment_gap = gaps_of_segments(fit_initial_states(train_, point, budget_.held_out_steps));
  }
  return h.training_segment_gap;
}

double Search::gap_of(const Hypothesis& h) const {
  return held_.segments.empty() ? whitened_rms(h.train) : whitened_rms(h.held);
}

}  // namespace upright
