// How much better one hypothesis is than another.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "model/dense_algebra.hpp"
#include "search.hpp"

namespace upright {

namespace {

/// Mean over its standard error.
double t_of(const std::vector<double>& values) {
  if (values.size() < 2) return 0.0;
  const auto n = static_cast<double>(values.size());
  double mean = 0.0, spread = 0.0;
  for (const double v : values) mean += v / n;
  for (const double v : values) spread += (v - mean) * (v - mean) / (n - 1.0);
  return mean / std::sqrt(std::max(spread / n, 1e-12));
}

/// Minus twice the log of likelihood and priors if the data count `dispersion` times less than the likelihood
/// says. The parameters are where that is least: a step from the fit, in which they count in full.
double tempered_objective(const Hypothesis& h, double dispersion) {
  const double likelihood = minus_log_likelihood(h.train) / dispersion;
  const auto n = static_cast<Eigen::Index>(h.free.size());
  if (n == 0) return likelihood;
  Eigen::VectorXd prior(n), off(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const FreeParameter& p = h.free[static_cast<std::size_t>(j)];
    prior[j] = p.prior_sigma > 0.0 ? 1.0 / (p.prior_sigma * p.prior_sigma) : 0.0;
    off[j] = h.train.point.plant.find(p.effect)->values[p.index] - p.prior_mean;
  }
  const Eigen::VectorXd pull = prior.cwiseProduct(off);
  Eigen::MatrixXd information = h.train.information / dispersion;
  information.diagonal() += (1.0 - 1.0 / dispersion) * prior;
  const double share = 1.0 - 1.0 / dispersion;
  return likelihood + off.dot(pull) -
         share * share * pull.dot(Eigen::VectorXd(solve_symmetric(information, pull)));
}

}  // namespace

Improvement compare(const Hypothesis& simpler, const Hypothesis& richer, double dispersion) {
  Improvement result;
  constexpr double never = -std::numeric_limits<double>::infinity();
  if (!std::isfinite(richer.train.objective)) return {never, never, never, never};
  std::vector<double> falls;
  const std::size_t blocks =
      std::min(simpler.train.block_objective.size(), richer.train.block_objective.size());
  for (std::size_t b = 0; b < blocks; ++b)
    falls.push_back(simpler.train.block_objective[b] - richer.train.block_objective[b]);
  result.train = tempered_objective(simpler, dispersion) - tempered_objective(richer, dispersion);
  result.prior = result.train - std::accumulate(falls.begin(), falls.end(), 0.0) / dispersion;
  result.held =
      (simpler.negative_log_predictive_density - richer.negative_log_predictive_density) / dispersion;
  result.t_value = t_of(falls);
  return result;
}

Improvement compare(const Hypothesis& simpler, const Hypothesis& richer) {
  return compare(simpler, richer, std::max(richer.train.dispersion, 1.0));
}

}  // namespace upright
