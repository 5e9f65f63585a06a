#include "belief.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

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
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(0.5 * (correlation + correlation.transpose()));
  const Eigen::VectorXd inverse = solver.eigenvalues().cwiseMax(min_eigenvalue).cwiseInverse();
  belief.information =
      unscale * solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose() * unscale;
  return belief;
}

}  // namespace upright
