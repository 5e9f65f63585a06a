#include "parameter_covariance.hpp"

#include <algorithm>
#include <cmath>

#include "model/dense_algebra.hpp"

namespace upright {

namespace {

/// Inverse of an information matrix. What holds no information at all is left out (zeros); combinations of
/// the others that hold none are as good as unknown.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& h) {
  const Eigen::VectorXd scale =
      h.diagonal().unaryExpr([](double v) { return v > 1e-200 ? 1.0 / std::sqrt(v) : 0.0; });
  const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * h * scale.asDiagonal());
  constexpr double min_eigenvalue = 1e-13;
  const Eigen::VectorXd inverse = eigen.values.cwiseMax(min_eigenvalue).cwiseInverse();
  const Eigen::MatrixXd vectors = scale.asDiagonal() * eigen.vectors;
  return vectors * inverse.asDiagonal() * vectors.transpose();
}

/// The scatter of the scores over segments, but in no direction less than the likelihood itself says: noise
/// that is whiter than it looks must not shrink an interval.
Eigen::MatrixXd robust_spread(const Eigen::MatrixXd& information, const Eigen::MatrixXd& spread) {
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::VectorXd unscale = scale.cwiseInverse();
  Eigen::MatrixXd unit = unscale.asDiagonal() * information * unscale.asDiagonal();
  unit.diagonal().array() += 1e-12;
  const SymmetricEigen eigen = symmetric_eigen(unit);
  if (!(eigen.values.minCoeff() > 0.0)) return information;
  const Eigen::VectorXd root = eigen.values.cwiseSqrt();
  // Columns of unit information; the scatter in their directions.
  const Eigen::MatrixXd whitening = unscale.asDiagonal() * eigen.vectors * root.cwiseInverse().asDiagonal();
  const SymmetricEigen scatter = symmetric_eigen(whitening.transpose() * spread * whitening);
  const Eigen::VectorXd raised = scatter.values.cwiseMax(1.0);
  const Eigen::MatrixXd half = scale.asDiagonal() * eigen.vectors * root.asDiagonal() * scatter.vectors;
  return half * raised.asDiagonal() * half.transpose();
}

Eigen::MatrixXd without_held(Eigen::MatrixXd h, const std::vector<bool>& held) {
  for (std::size_t j = 0; j < held.size(); ++j) {
    if (!held[j]) continue;
    const auto at = static_cast<Eigen::Index>(j);
    h.row(at).setZero();
    h.col(at).setZero();
  }
  return h;
}

}  // namespace

Eigen::MatrixXd sandwich_covariance(const Eigen::MatrixXd& information, const Eigen::MatrixXd& spread,
                                    const Eigen::MatrixXd& prior, const std::vector<bool>& held) {
  const Eigen::MatrixXd inverse = inverse_of(without_held(information, held));
  return inverse * (robust_spread(information - prior, spread) + prior) * inverse;
}

double dispersion(const Eigen::MatrixXd& information, const Eigen::MatrixXd& spread) {
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
