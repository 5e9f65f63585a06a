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

std::optional<SchurForm> schur_form(const MatrixXd& matrix) {
  const Eigen::ComplexSchur<MatrixXcd> factored(matrix.cast<std::complex<double>>());
  if (factored.info() != Eigen::Success) return std::nullopt;
  return SchurForm{factored.matrixT(), factored.matrixU()};
}

MatrixXd inverse(const MatrixXd& matrix) {
  return solve(matrix, MatrixXd(MatrixXd::Identity(matrix.rows(), matrix.rows())));
}

std::optional<MatrixXd> inverse_if_regular(const MatrixXd& matrix, double min_rcond) {
  const Eigen::PartialPivLU<MatrixXd> factored(matrix);
  if (!(factored.rcond() >= min_rcond)) return std::nullopt;
  return factored.solve(MatrixXd(MatrixXd::Identity(matrix.rows(), matrix.rows())));
}

MatrixXd pseudo_inverse(const MatrixXd& matrix) {
  return least_squares(matrix, MatrixXd::Identity(matrix.rows(), matrix.rows()));
}

Eigen::VectorXcd solve(const MatrixXcd& a, const Eigen::VectorXcd& b) {
  return a.partialPivLu().solve(b);
}

VectorXd solve(const MatrixXd& a, const VectorXd& b) {
  return a.partialPivLu().solve(b);
}

MatrixXd solve(const MatrixXd& a, const MatrixXd& b) {
  return a.partialPivLu().solve(b);
}

MatrixXcd solve_from_right(const MatrixXcd& a, const MatrixXcd& b) {
  return a.transpose().partialPivLu().solve(b.transpose()).transpose();
}

MatrixXd least_squares(const MatrixXd& a, const MatrixXd& b) {
  return a.completeOrthogonalDecomposition().solve(b);
}

MatrixXd solve_symmetric(const MatrixXd& a, const MatrixXd& b) {
  return a.ldlt().solve(b);
}

VectorXd symmetric_pivots(const MatrixXd& matrix) {
  return matrix.ldlt().vectorD();
}

MatrixXd completed_basis(const MatrixXd& columns) {
  return columns.completeOrthogonalDecomposition().householderQ();
}

}  // namespace upright
