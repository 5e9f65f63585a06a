// What takes a factorisation of a matrix whose size is known at run time only, compiled once: a file that
// lets Eigen write one out takes ten to twenty seconds more to compile.
#pragma once

#include <Eigen/Core>

namespace upright {

/// The n eigenvalues of an n x n matrix, in no particular order.
Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& matrix);

/// Of an n x n matrix that has one.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& matrix);

/// x of a x = b, for a regular n x n matrix.
Eigen::VectorXcd solve(const Eigen::MatrixXcd& a, const Eigen::VectorXcd& b);

/// An orthonormal basis of the whole space, n x n; its first r columns span what `columns`, n x r of rank r,
/// do.
Eigen::MatrixXd completed_basis(const Eigen::MatrixXd& columns);

}  // namespace upright
