#include "dense_algebra.hpp"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>

namespace upright {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Eigen::VectorXcd eigenvalues(const MatrixXd& matrix) {
  return matrix.eigenvalues();
}

SymmetricEigen symmetric_eigen(const MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

MatrixXd inverse(const MatrixXd& matrix) {
  return matrix.inverse();
}

std::optional<MatrixXd> inverse_if_regular(const MatrixXd& matrix, double min_rcond) {
  const Eigen::FullPivLU<MatrixXd> factored(matrix);
  if (!factored.isInvertible() || factored.rcond() < min_rcond) return std::nullopt;
  return factored.inverse();
}

MatrixXd pseudo_inverse(const MatrixXd& matrix) {
  return matrix.completeOrthogonalDecomposition().pseudoInverse();
}

Eigen::VectorXcd solve(const MatrixXcd& a, const Eigen::VectorXcd& b) {
  return a.partialPivLu().solve(b);
}

MatrixXd solve_symmetric(const MatrixXd& a, const MatrixXd& b) {
  return a.ldlt().solve(b);
}

VectorXd symmetric_pivots(const MatrixXd& matrix) {
  return matrix.ldlt().vectorD();
}

MatrixXd completed_basis(const MatrixXd& columns) {
  return columns.householderQr().householderQ();
}

}  // namespace upright
