#include "belief.hpp"

#include <cmath>

#include "model/dense_algebra.hpp"

namespace upright {

GaussianPrior belief_of(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance,
                        const Eigen::VectorXd& min_sigma) {
  const Eigen::Index n = mean.size();
  GaussianPrior belief{mean, Eigen::MatrixXd::Zero(n, n)};
  if (n == 0) return belief;
  Eigen::VectorXd scale(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    scale[j] = std::sqrt(covariance(j, j));
    if (!(scale[j] > 0.0)) scale[j] = min_sigma[j];
  }
  const Eigen::MatrixXd unscale = scale.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd correlation = unscale * covariance * unscale;
  constexpr double min_eigenvalue = 1e-9;
  const SymmetricEigen eigen = symmetric_eigen(0.5 * (correlation + correlation.transpose()));
  const Eigen::VectorXd inverse = eigen.values.cwiseMax(min_eigenvalue).cwiseInverse();
  belief.information = unscale * eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose() * unscale;
  return belief;
}

}  // namespace upright
