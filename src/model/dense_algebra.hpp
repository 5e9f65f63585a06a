// Matrix factorisations of dynamic size, compiled once: each file that instantiates one takes ten to
// twenty seconds longer to compile.
#pragma once

#include <Eigen/Core>

namespace upright {

/// The n eigenvalues of an n x n matrix, in no particular order.
Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& matrix);

/// Inverse of a regular n x n matrix.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& matrix);

/// Solution x of a x = b for a regular n x n matrix.
Eigen::VectorXcd solve(const Eigen::MatrixXcd& a, const Eigen::VectorXcd& b);

/// An orthonormal basis of the whole space, n x n. Its first r columns span the range of `columns` (n x
/// r, rank r).
Eigen::MatrixXd completed_basis(const Eigen::MatrixXd& columns);

}  // namespace upright
