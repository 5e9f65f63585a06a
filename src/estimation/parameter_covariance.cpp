#include "parameter_covariance.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/dense_algebra.hpp"

namespace upright {

namespace {

using Matrix = Eigen::MatrixXd;

/// Inverse of an information matrix. What holds no information at all is left out (zeros); combinations of
/// the others that hold none are as good as unknown.
Matrix inverse_of(const Matrix& h) {
  const Eigen::VectorXd scale =
      h.diagonal().unaryExpr([](double v) { return v > 1e-200 ? 1.0 / std::sqrt(v) : 0.0; });
  const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * h * scale.asDiagonal());
  constexpr double min_eigenvalue = 1e-13;
  const Eigen::VectorXd inverse = eigen.values.cwiseMax(min_eigenvalue).cwiseInverse();
  const Matrix directions = scale.asDiagonal() * eigen.vectors;
  const Matrix weighted = directions * inverse.asDiagonal();
  return weighted * directions.transpose();
}

/// The scatter of the scores over segments, but in no direction less than the likelihood itself says: noise
/// that is whiter than it looks must not shrink an interval.
Matrix robust_spread(const Matrix& information, const Matrix& spread) {
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::VectorXd unscale = scale.cwiseInverse();
  Matrix unit = unscale.asDiagonal() * information * unscale.asDiagonal();
  unit.diagonal().array() += 1e-12;
  const SymmetricEigen axes = symmetric_eigen(unit);
  if (!(axes.values.minCoeff() > 0.0)) return information;
  // In these directions the information is the identity.
  const Matrix whitened =
      unscale.asDiagonal() * axes.vectors * axes.values.cwiseSqrt().cwiseInverse().asDiagonal();
  const Matrix spread_of_whitened = spread * whitened;
  const Matrix relative = whitened.transpose() * spread_of_whitened;
  const SymmetricEigen eigen = symmetric_eigen(0.5 * (relative + relative.transpose()));
  const Matrix root = scale.asDiagonal() * axes.vectors * axes.values.cwiseSqrt().asDiagonal();
  const Matrix half = root * eigen.vectors;
  const Matrix raised = half * eigen.values.cwiseMax(1.0).asDiagonal();
  return raised * half.transpose();
}

Matrix without_held(Matrix h, const std::vector<bool>& held) {
  for (std::size_t j = 0; j < held.size(); ++j) {
    if (!held[j]) continue;
    const auto at = static_cast<Eigen::Index>(j);
    h.row(at).setZero();
    h.col(at).setZero();
  }
  return h;
}

/// Of a normal deviate that is known to be above `lowest`: by how much it is above it at most, with 95 %
/// confidence.
double reach_above(double lowest) {
  constexpr double share_above = 0.05, exponential_from = 30.0;
  // The tail is nearly exponential there.
  if (lowest > exponential_from) return -std::log(share_above) / lowest;
  const auto above = [](double deviate) { return std::erfc(deviate * std::numbers::sqrt2 / 2.0); };
  double low = 0.0, high = exponential_from;
  constexpr int halvings = 40;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    (above(lowest + middle) > share_above * above(lowest) ? low : high) = middle;
  }
  return high;
}

}  // namespace

Matrix sandwich_covariance(const Matrix& information, const Matrix& spread, const Matrix& prior,
                           const std::vector<bool>& held) {
  const Matrix inverse = inverse_of(without_held(information, held));
  return inverse * (robust_spread(information - prior, spread) + prior) * inverse;
}

Eigen::VectorXd reach_from_bounds(const Matrix& information, const Eigen::VectorXd& score, double dispersion,
                                  const std::vector<bool>& held) {
  Eigen::VectorXd reach = Eigen::VectorXd::Zero(score.size());
  if (std::find(held.begin(), held.end(), true) == held.end()) return reach;
  const Matrix of_others = inverse_of(without_held(information, held));
  for (Eigen::Index j = 0; j < score.size(); ++j) {
    if (!held[static_cast<std::size_t>(j)]) continue;
    // Those that are not held follow it.
    const double own = information(j, j) - information.col(j).dot(of_others * information.col(j));
    if (!(own > 0.0)) continue;
    const double sigma = std::sqrt(dispersion / own);
    reach[j] = sigma * reach_above(std::abs(score[j]) / own / sigma);
  }
  return reach;
}

double dispersion(const Matrix& information, const Matrix& spread) {
  const Eigen::VectorXd scale =
      information.diagonal().unaryExpr([](double v) { return v > 1e-200 ? 1.0 / std::sqrt(v) : 0.0; });
  const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * information * scale.asDiagonal());
  constexpr double min_eigenvalue = 1e-9;
  double sum = 0.0, directions = 0.0;
  for (Eigen::Index i = 0; i < eigen.values.size(); ++i) {
    if (!(eigen.values[i] > min_eigenvalue)) continue;
    const Eigen::VectorXd way = scale.cwiseProduct(eigen.vectors.col(i));
    sum += way.dot(spread * way) / eigen.values[i];
    directions += 1.0;
  }
  return directions > 0.0 ? std::max(sum / directions, 1.0) : 1.0;
}

}  // namespace upright
