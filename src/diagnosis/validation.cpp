#include "validation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimation/noise_floor.hpp"
#include "motion_range.hpp"
#include "search_budget.hpp"
#include "selection_policy.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

struct Simulated {
  ModelScore score;  ///< the gap in sensor noise
  FitPoint point;
};

Simulated simulated(const FitData& data, const Plant& plant) {
  const Measurement& run = data.runs->front();
  const FitResult fitted =
      fit_initial_states(data, {plant, estimate_initial_states(*data.runs, data.segments, plant), {}});
  double squares[2] = {0.0, 0.0}, count = 0.0;
  for (const std::vector<LinearStep>& segment : linearise(data, fitted.point))
    for (const LinearStep& step : segment) {
      for (int channel = 0; channel < 2; ++channel)
        squares[channel] += step.residual[channel] * step.residual[channel];
      count += 1.0;
    }
  constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();
  const bool theta = run.has_theta() && plant.pendulum.has_value();
  return {{whitened_rms(fitted), run.has_cart() ? std::sqrt(squares[0] / count) : not_measured,
           theta ? std::sqrt(squares[1] / count) : not_measured},
          fitted.point};
}

}  // namespace

std::vector<ValidatedRun> validate(const Plant& given, const Diagnosis& diagnosis,
                                   const std::vector<Measurement>& runs) {
  std::vector<ValidatedRun> validated;
  for (const Measurement& run : runs) {
    const std::vector<Measurement> one = {run};
    const FitData data{&one, cut_segments(one)};
    if (data.segments.empty())
      throw ConfigError("no part of " + run.name + " is long enough to simulate: validate with a longer run");
    Simulated before = simulated(data, given), after = simulated(data, diagnosis.model);
    FitPoint noisy = after.point;
    noisy.noise = diagnosis.noise;
    // What a model reached is no less than what noise makes.
    const double floor = std::min(
        {simulation_floor(data, noisy, SearchBudget{}.floor_draws).usual, before.score.gap, after.score.gap});
    before.score.gap /= floor;
    after.score.gap /= floor;
    validated.push_back(
        {run.name, before.score, after.score,
         beyond_range(motion_range(one, ExcitationPolicy{}.speed_window_s), diagnosis.measured_range)});
  }
  return validated;
}

}  // namespace upright
