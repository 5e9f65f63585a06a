#include "run_differences.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "estimation/size_by_run.hpp"
#include "tails.hpp"

namespace upright {

namespace {

constexpr double normal_95 = 1.96;

/// Probability that a normal deviate exceeds z.
double upper_tail(double z) {
  return 0.5 * std::erfc(z / std::sqrt(2.0));
}

/// The weighted mean of all runs but one, and the standard error of that run's distance from it.
struct Contrast {
  double distance = 0.0, standard_error = 0.0;
};

Contrast against_the_others(const SizeByRun& sizes, Eigen::Index run) {
  const Eigen::Index n = sizes.value.size();
  Eigen::VectorXd weights = sizes.covariance.diagonal().cwiseMax(1e-300).cwiseInverse();
  weights[run] = 0.0;
  weights /= -weights.sum();
  weights[run] = 1.0;
  const double variance = weights.dot(sizes.covariance * weights);
  return {n > 1 ? weights.dot(sizes.value) : 0.0, std::sqrt(std::max(variance, 1e-300))};
}

/// By how many standard errors half of the mean size exceeds what a new run may be below it. The variance
/// between runs has a scaled inverse chi-square prior: friction changes from day to day by a share of its
/// size
/// (`PriorPolicy::friction`). The runs add what they show of it.
double certainty_of_help(const Eigen::VectorXd& size, const Eigen::VectorXd& variance,
                         const PriorPolicy& policy) {
  constexpr double prior_freedom = 2.0;  // the least with which two runs that agree are two that agree
  const Eigen::VectorXd weight = variance.cwiseInverse();
  const double sum = weight.sum(), fixed_mean = weight.dot(size) / sum;
  const double seen = static_cast<double>(size.size()) - 1.0;
  const double q = weight.dot((size.array() - fixed_mean).square().matrix());
  const double between = std::max(0.0, (q - seen) / (sum - weight.squaredNorm() / sum));
  const double believed = std::pow(policy.friction * fixed_mean, 2);
  const double freedom = prior_freedom + seen;
  const double drawn = (prior_freedom * believed + seen * between) / freedom;
  const Eigen::VectorXd weight_of_draw = (variance.array() + drawn).inverse();
  const double mean = weight_of_draw.dot(size) / weight_of_draw.sum();
  const double spread = std::sqrt(drawn + 1.0 / weight_of_draw.sum());
  return normal_deviate(0.5 * std::abs(mean) / spread, freedom);
}

/// The runs of these sizes.
std::vector<const Measurement*> runs_of(const SizeByRun& sizes, const std::vector<Measurement>& runs) {
  std::vector<const Measurement*> of;
  for (const std::size_t run : sizes.runs) of.push_back(&runs[run]);
  return of;
}

RunDifference difference_of(std::size_t effect, const SizeByRun& sizes, const std::vector<Measurement>& runs,
                            double nothing, const PriorPolicy& policy) {
  RunDifference result;
  result.effect = effect;
  const Eigen::VectorXd variance = sizes.covariance.diagonal().cwiseMax(1e-300);
  for (std::size_t r = 0; r < sizes.runs.size(); ++r) {
    const auto at = static_cast<Eigen::Index>(r);
    const double off = normal_95 * std::sqrt(variance[at]);
    result.sizes.push_back({sizes.runs[r], sizes.value[at], sizes.value[at] - off, sizes.value[at] + off});
    const Contrast contrast = against_the_others(sizes, at);
    const double deviate = normal_deviate(contrast.distance / contrast.standard_error, sizes.freedom);
    result.certainty = std::max(result.certainty, deviate);
  }
  result.certainty_of_help = certainty_of_help(sizes.value.array() - nothing, variance, policy);
  result.depends = dependences_of(sizes.value, runs_of(sizes, runs));
  return result;
}

}  // namespace

std::vector<RunDifference> run_differences(const Search& search, const Hypothesis& h,
                                           const std::vector<std::size_t>& effects) {
  std::vector<RunDifference> result;
  const FitData all = search.all_data();
  if (all.runs->size() < 2 || !search.is_of_all_data(h.train.point)) return result;
  std::vector<ParameterEquations> equations;
  for (const std::size_t effect : effects) {
    const ParameterInfo& size = effect_registry()[effect].parameters[0];
    if (search.is_nuisance(effect) || std::isnan(size.neutral)) continue;
    const auto place = std::find_if(h.free.begin(), h.free.end(), [&](const FreeParameter& p) {
      return p.effect == effect && p.index == 0;
    });
    if (place == h.free.end()) continue;
    if (equations.empty()) equations = parameter_equations(all, h.train.point, h.free);
    const SizeByRun sizes = size_by_run(equations, all.segments, h.train.point, h.free,
                                        static_cast<std::size_t>(place - h.free.begin()));
    if (sizes.freedom < 1.0 || sizes.runs.size() < 2) continue;
    result.push_back(difference_of(effect, sizes, *all.runs, size.neutral, search.policy().prior));
  }
  return result;
}

bool is_of_single_runs(const RunDifference& difference, const SignificancePolicy& policy) {
  const auto runs = static_cast<double>(difference.sizes.size());
  const bool differs = upper_tail(difference.certainty) < upper_tail(policy.noticeable_z) / runs;
  return differs && difference.certainty_of_help < policy.interval_z;
}

const RunDifference* most_certain_of_single_runs(const std::vector<RunDifference>& differences,
                                                 const SignificancePolicy& policy) {
  const RunDifference* most = nullptr;
  for (const RunDifference& difference : differences)
    if (is_of_single_runs(difference, policy) && (most == nullptr || difference.certainty > most->certainty))
      most = &difference;
  return most;
}

std::string sentence_on(const RunDifference& difference, const std::vector<Measurement>& runs) {
  const ParameterInfo& size = effect_registry()[difference.effect].parameters[0];
  std::ostringstream text;
  text.precision(3);
  text << "its size differs from run to run by more than its uncertainty";
  const std::vector<std::string>* label = nullptr;
  for (const RunDependence& feature : difference.depends) {
    text << (&feature == &difference.depends.front() ? ", and depends on " : " or on ") << feature.on;
    if (!label && !feature.texts.empty()) label = &feature.texts;
  }
  text << ":";
  for (std::size_t i = 0; i < difference.sizes.size(); ++i) {
    const RunSize& of = difference.sizes[i];
    text << (i > 0 ? ", " : " ") << of.value << " " << size.unit << " in " << runs[of.run].name;
    if (label) text << " (" << (*label)[i] << ")";
  }
  text << "; for a model of some of these runs, diagnose them alone";
  return text.str();
}

}  // namespace upright
