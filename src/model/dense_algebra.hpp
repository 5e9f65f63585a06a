// Matrix factorisations of dynamic size, compiled once: each library that instantiates one takes ten to
// twenty seconds longer to compile.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace upright {

/// The n eigenvalues of an n x n matrix, in no particular order.
Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& matrix);

/// Inverse of a regular n x n matrix.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& matrix);

/// Inverse of an n x n matrix by complete pivoting; absent where it is singular, or its reciprocal condition
/// number below `min_rcond`.
std::optional<Eigen::MatrixXd> inverse_if_regular(const Eigen::MatrixXd& matrix, double min_rcond);

/// Solution x of a x = b for a regular n x n matrix.
Eigen::VectorXcd solve(const Eigen::MatrixXcd& a, const Eigen::VectorXcd& b);

/// Solution x of a x = b for a symmetric n x n matrix that is positive or negative semidefinite.
Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// An orthonormal basis of the whole space, n x n. Its first r columns span the range of `columns` (n x
/// r, rank r).
Eigen::MatrixXd completed_basis(const Eigen::MatrixXd& columns);

}  // namespace upright
