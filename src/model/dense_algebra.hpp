// Matrix factorisations of dynamic size, compiled once: each library that instantiates one takes ten to
// twenty seconds longer to compile.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace upright {

/// The n eigenvalues of an n x n matrix, in no particular order.
Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& matrix);

/// Eigenvalues of a symmetric n x n matrix in increasing order, and their orthonormal vectors as columns.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& matrix);

/// An n x n matrix = u t u^H with u unitary and t upper triangular. Absent where the iteration does not
/// converge, as with entries that are not finite.
struct SchurForm {
  Eigen::MatrixXcd t, u;
};
std::optional<SchurForm> schur_form(const Eigen::MatrixXd& matrix);

/// Inverse of a regular n x n matrix.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& matrix);

/// Inverse of an n x n matrix; absent where it is singular, or its reciprocal condition number below
/// `min_rcond`.
std::optional<Eigen::MatrixXd> inverse_if_regular(const Eigen::MatrixXd& matrix, double min_rcond);

/// The inverse of Moore and Penrose of an n x n matrix, by complete orthogonal decomposition.
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& matrix);

/// Solution x of a x = b for a regular n x n matrix.
Eigen::VectorXcd solve(const Eigen::MatrixXcd& a, const Eigen::VectorXcd& b);
Eigen::VectorXd solve(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
/// The same with a right side in each column of b.
Eigen::MatrixXd solve(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// Solution x of x a = b for a regular n x n matrix.
Eigen::MatrixXcd solve_from_right(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b);

/// The shortest x that minimises |a x - b|, for each column of b.
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Solution x of a x = b for a symmetric n x n matrix that is positive or negative semidefinite.
Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// The n diagonal entries of D in P'LDL'P = a symmetric n x n matrix; their product is its determinant.
Eigen::VectorXd symmetric_pivots(const Eigen::MatrixXd& matrix);

/// An orthonormal basis of the whole space, n x n. Its first r columns span the range of `columns` (n x
/// r, rank r).
Eigen::MatrixXd completed_basis(const Eigen::MatrixXd& columns);

}  // namespace upright
