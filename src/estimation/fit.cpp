#include "fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/parallel.hpp"
#include "gauss_newton.hpp"
#include "noise_estimation.hpp"
#include "parameter_covariance.hpp"
#include "state_vector.hpp"

namespace upright {

namespace {

/// Gauss-Newton and the estimate of the noise in turn. `objective`: of the present point.
void iterate(const FitData& data, const FitOptions& options, GaussNewton& solver, double objective) {
  const auto estimate = [&](const std::vector<double>& factors) {
    solver.require_steps();
    return estimate_noise(data, solver.linearised(), factors, options.coloured_noise, solver.point());
  };
  if (options.alternative_noise) {
    solver.require_steps();
    const std::vector<double> objectives = noise_objectives(
        data, solver.point().plant, solver.linearised(), {solver.point().noise, *options.alternative_noise});
    if (objectives[1] < objectives[0]) {
      solver.point().noise = *options.alternative_noise;
      objective = solver.evaluate();
    }
  }
  if (options.noise_rounds == 0) solver.descend(objective);
  if (std::isfinite(objective) && objective < options.noise_at_end_below) {
    estimate({4.0, 1.5, 1.15});
    objective = solver.evaluate();
  }
  for (int round = 0; round < options.noise_rounds && std::isfinite(objective) && solver.is_within_bound();
       ++round) {
    const double before = objective;
    constexpr double settled = 2.0, no_matter = 0.5;
    const Noise former = solver.point().noise;
    // What was estimated before is near.
    const double gain = round == 0 ? estimate({10.0, 2.0, 1.2}) : estimate({1.2});
    if (round > 0 && solver.converged() && gain < no_matter) {
      solver.point().noise = former;
      break;
    }
    objective = solver.evaluate();
    solver.descend(objective);
    if (round > 0 && before - objective < settled) break;
  }
}

/// Of each free parameter whether it stands at a bound.
std::vector<bool> at_bounds(const Plant& plant, const std::vector<FreeParameter>& free) {
  std::vector<bool> held;
  held.reserve(free.size());
  for (const FreeParameter& p : free) {
    const double value = plant.find(p.effect)->values[p.index];
    held.push_back(!(value > p.low && value < p.high));
  }
  return held;
}

FitResult result_of(const GaussNewton& solver, const std::vector<FreeParameter>& free) {
  FitResult result;
  result.converged = solver.converged();
  result.work_samples = solver.work_samples();
  result.point = solver.point();
  result.objective = solver.prior().objective(result.point.plant);
  for (const LinearisedSegment& segment : solver.linearised()) {
    const NormalEquations& n = segment.normal;
    result.segment_objective.push_back(n.likelihood.objective());
    result.block_objective.insert(result.block_objective.end(), n.blocks.begin(), n.blocks.end());
    result.segment_chi_square.push_back(n.likelihood.chi_square);
    result.segment_samples.push_back(n.likelihood.samples);
    result.objective += n.likelihood.objective();
  }
  if (!std::isfinite(result.objective)) result.objective = std::numeric_limits<double>::infinity();
  result.information = solver.prior().information();
  if (free.empty()) return result;
  const GaussNewton::Information information = solver.information();
  result.information = information.total;
  result.dispersion = dispersion(information.total - solver.prior().information(), information.scatter);
  const std::vector<bool> held = at_bounds(result.point.plant, free);
  result.covariance =
      sandwich_covariance(information.total, information.scatter, solver.prior().information(), held);
  result.bound_reach = reach_from_bounds(information.total, information.score, result.dispersion, held);
  if (!std::isfinite(result.objective)) return result;
  const GaussNewton::Step further = solver.further_step();
  result.bounded_reduction = further.predicted_reduction;
  if (!further.cut_short) result.predicted_reduction = further.predicted_reduction;
  return result;
}

/// Goes on from the present point, which has this objective.
FitResult fit_from(const FitData& data, const std::vector<FreeParameter>& free, const FitOptions& options,
                   GaussNewton& solver, double objective) {
  iterate(data, options, solver, objective);
  FitResult result = result_of(solver, free);
  if (options.keep_equations) {
    std::vector<NormalEquations> equations;
    equations.reserve(solver.linearised().size());
    for (const LinearisedSegment& segment : solver.linearised()) equations.push_back(segment.normal);
    result.equations = std::make_shared<const std::vector<NormalEquations>>(std::move(equations));
  }
  if (data.bound != nullptr) data.bound->count(result.work_samples);
  return result;
}

/// Of more parameters than a fit can free.
FitResult failed_at(const FitPoint& start, std::size_t segments, std::size_t free) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  const auto n = static_cast<Eigen::Index>(free);
  FitResult result;
  result.point = start;
  result.objective = infinite;
  result.segment_objective.assign(segments, infinite);
  result.segment_chi_square.assign(segments, infinite);
  result.segment_samples.assign(segments, 0.0);
  result.covariance = result.information = Eigen::MatrixXd::Zero(n, n);
  result.bound_reach = Eigen::VectorXd::Zero(n);
  return result;
}

}  // namespace

FitOptions steps_with_fixed_noise(int steps) {
  FitOptions options;
  options.max_iterations = steps;
  options.noise_rounds = 0;
  return options;
}

std::size_t max_free_parameters(const Plant& plant) {
  return max_derivatives - static_cast<std::size_t>(estimated_states(plant));
}

FitResult fit(const FitData& data, const FitPoint& start, const std::vector<FreeParameter>& free,
              const FitOptions& options) {
  if (data.bound != nullptr) data.bound->check();
  if (free.size() > max_free_parameters(start.plant))
    return failed_at(start, data.segments.size(), free.size());
  GaussNewton solver(data, start, free, options);
  const double objective = solver.evaluate();
  return fit_from(data, free, options, solver, objective);
}

FitResult continue_fit(const FitData& data, const FitResult& from, const std::vector<FreeParameter>& free,
                       const FitOptions& options) {
  if (from.equations == nullptr) return fit(data, from.point, free, options);
  if (data.bound != nullptr) data.bound->check();
  GaussNewton solver(data, from.point, free, options);
  const double objective = solver.begin_with(*from.equations);
  return fit_from(data, free, options, solver, objective);
}

double objective_after_step(const FitResult& seen) {
  return seen.objective - std::max(0.0, seen.bounded_reduction);
}

double objective_after_step(const FitData& data, const FitPoint& point,
                            const std::vector<FreeParameter>& free) {
  return objective_after_step(fit(data, point, free, steps_with_fixed_noise(0)));
}

std::vector<std::vector<LinearStep>> linearise(const FitData& data, const FitPoint& point) {
  std::vector<std::vector<LinearStep>> steps(data.segments.size());
  parallel_for(data.segments.size(),
               [&](std::size_t s) { linearise_segment(data, s, point, {}, steps[s], nullptr); });
  return steps;
}

double whitened_rms(const FitResult& result) {
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t s = 0; s < result.segment_chi_square.size(); ++s) {
    sum += result.segment_chi_square[s];
    count += result.segment_samples[s];
  }
  return std::sqrt(sum / std::max(count, 1e-9));
}

double minus_log_likelihood(const FitResult& result) {
  return std::accumulate(result.segment_objective.begin(), result.segment_objective.end(), 0.0);
}

}  // namespace upright
