#include "size_by_run.hpp"

#include <algorithm>

#include "model/dense_algebra.hpp"

namespace upright {

namespace {

std::vector<std::size_t> runs_of(const std::vector<Segment>& segments) {
  std::vector<std::size_t> runs;
  runs.reserve(segments.size());
  for (const Segment& segment : segments) runs.push_back(segment.run);
  std::sort(runs.begin(), runs.end());
  runs.erase(std::unique(runs.begin(), runs.end()), runs.end());
  return runs;
}

/// Where the parameters of a segment stand among those of all runs: common ones first, then one of each run.
class Places {
 public:
  Places(std::size_t own, const std::vector<std::size_t>& runs, std::size_t parameters)
      : own_(own), runs_(runs), parameters_(parameters) {}

  Eigen::Index count() const { return static_cast<Eigen::Index>(parameters_ - 1 + runs_.size()); }
  Eigen::Index of_run(std::size_t r) const { return static_cast<Eigen::Index>(parameters_ - 1 + r); }
  std::vector<Eigen::Index> of(std::size_t run) const {
    const auto r = std::lower_bound(runs_.begin(), runs_.end(), run) - runs_.begin();
    std::vector<Eigen::Index> places;
    for (std::size_t j = 0; j < parameters_; ++j)
      places.push_back(j == own_ ? of_run(static_cast<std::size_t>(r))
                                 : static_cast<Eigen::Index>(j < own_ ? j : j - 1));
    return places;
  }

 private:
  std::size_t own_;
  const std::vector<std::size_t>& runs_;
  std::size_t parameters_;
};

}  // namespace

SizeByRun size_by_run(const std::vector<ParameterEquations>& equations, const std::vector<Segment>& segments,
                      const FitPoint& point, const std::vector<FreeParameter>& free, std::size_t place) {
  SizeByRun result;
  result.runs = runs_of(segments);
  const Places places(place, result.runs, free.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(places.count(), places.count());
  Eigen::VectorXd score = Eigen::VectorXd::Zero(places.count());
  for (std::size_t j = 0; j < free.size(); ++j) {
    const FreeParameter& p = free[j];
    if (j == place || !(p.prior_sigma > 0.0)) continue;
    const auto at = static_cast<Eigen::Index>(j < place ? j : j - 1);
    const double weight = 1.0 / (p.prior_sigma * p.prior_sigma);
    information(at, at) += weight;
    score[at] -= weight * (point.plant.find(p.effect)->values[p.index] - p.prior_mean);
  }
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const std::vector<Eigen::Index> at = places.of(segments[s].run);
    information(at, at) += equations[s].information;
    score(at) += equations[s].score;
  }
  const Eigen::MatrixXd covariance = pseudo_inverse(information);
  const Eigen::VectorXd step = covariance * score;
  const auto n = static_cast<Eigen::Index>(result.runs.size());
  const double value = point.plant.find(free[place].effect)->values[free[place].index];
  result.value = Eigen::VectorXd::Constant(n, value) + step.tail(n);
  result.covariance = covariance.bottomRightCorner(n, n);
  result.freedom = static_cast<double>(segments.size()) - static_cast<double>(n);
  if (!(result.freedom > 0.0)) return result;
  Eigen::VectorXd scatter = Eigen::VectorXd::Zero(n);
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const std::vector<Eigen::Index> at = places.of(segments[s].run);
    const Eigen::VectorXd left = equations[s].score - equations[s].information * step(at);
    const Eigen::VectorXd influence = covariance(Eigen::all, at) * left;
    scatter += influence.tail(n).cwiseAbs2();
  }
  const double small_sample = static_cast<double>(segments.size()) / result.freedom;
  const double dispersion =
      small_sample * scatter.cwiseQuotient(result.covariance.diagonal().cwiseMax(1e-300)).mean();
  result.covariance *= std::max(dispersion, 1.0);
  return result;
}

}  // namespace upright
