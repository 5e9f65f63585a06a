#include "dense_algebra.hpp"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>

namespace upright {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;

Eigen::VectorXcd eigenvalues(const MatrixXd& matrix) {
  return matrix.eigenvalues();
}

MatrixXd inverse(const MatrixXd& matrix) {
  return matrix.inverse();
}

Eigen::VectorXcd solve(const MatrixXcd& a, const Eigen::VectorXcd& b) {
  return a.partialPivLu().solve(b);
}

MatrixXd completed_basis(const MatrixXd& columns) {
  return columns.householderQr().householderQ();
}

}  // namespace upright
