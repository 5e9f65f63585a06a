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

std::optional<MatrixXd> inverse_if_regular(const MatrixXd& matrix, double min_rcond) {
  const Eigen::FullPivLU<MatrixXd> factored(matrix);
  if (!factored.isInvertible() || factored.rcond() < min_rcond) return std::nullopt;
  return factored.inverse();
}

Eigen::VectorXcd solve(const MatrixXcd& a, const Eigen::VectorXcd& b) {
  return a.partialPivLu().solve(b);
}

MatrixXd solve_symmetric(const MatrixXd& a, const MatrixXd& b) {
  return a.ldlt().solve(b);
}

MatrixXd completed_basis(const MatrixXd& columns) {
  return columns.householderQr().householderQ();
}

}  // namespace upright
