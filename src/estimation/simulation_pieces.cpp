#include "simulation_pieces.hpp"

#include <algorithm>
#include <cmath>

#include "segment_start.hpp"

namespace upright {

namespace {

/// How long a command still acts after the next one was given.
double command_memory_s(const Plant& plant) {
  const PlantModel<double> model = make_model<double>(plant);
  const Dynamics<double> dynamics(model);
  return dynamics.input_delay_s() + lag_memory_constants * dynamics.motor_time_constant_s();
}

std::size_t first_at(const Measurement& run, double time_s) {
  return static_cast<std::size_t>(std::lower_bound(run.time_s.begin(), run.time_s.end(), time_s) -
                                  run.time_s.begin());
}

/// Samples first..end-1, without a gap, cut by the horizon.
void cut_stretch(const Measurement& run, Segment stretch, const SimulationOptions& options,
                 std::vector<Segment>& pieces) {
  const auto close = [&](std::size_t first, std::size_t last) {
    if (last + 1 >= first + options.initial_samples) pieces.push_back({stretch.run, first, last});
  };
  if (!options.horizon_s) return close(stretch.first, stretch.last);
  // Time stamps are rounded: a sample that is early by less than this begins the next piece.
  constexpr double slack_periods = 0.01;
  const double slack_s = slack_periods * run.median_period_s();
  std::size_t first = stretch.first;
  for (double number = 1.0; first <= stretch.last; number += 1.0) {
    const double end_s = run.time_s[stretch.first] + number * *options.horizon_s - slack_s;
    const std::size_t next = std::clamp(first_at(run, end_s), first, stretch.last + 1);
    if (next > first) close(first, next - 1);
    first = next;
  }
}

}  // namespace

std::vector<Segment> simulation_pieces(const Measurement& run, std::size_t number, const Plant& plant,
                                       const SimulationOptions& options) {
  std::vector<Segment> pieces;
  const double memory_s = command_memory_s(plant);
  const std::size_t begin = options.from_s ? first_at(run, *options.from_s) : 0;
  std::size_t first = begin;
  std::vector<std::size_t> ends = gaps_in(run);
  ends.push_back(run.size());
  for (const std::size_t end : ends) {
    if (end > first) cut_stretch(run, {number, first, end - 1}, options, pieces);
    if (end == run.size()) break;
    const std::size_t resumes = memory_s > 0.0 ? first_at(run, run.time_s[end] + memory_s) : end;
    first = std::max({begin, first, resumes});
  }
  return pieces;
}

}  // namespace upright
