// The algebraic Riccati equations of linear-quadratic design, one input.
#pragma once

#include <Eigen/Core>

namespace upright {

/// u = -gain x minimises the cost.
struct RiccatiSolution {
  Eigen::MatrixXd x;        ///< n x n, symmetric: the cost from a state is s' x s
  Eigen::RowVectorXd gain;  ///< 1 x n
  double residual = 0.0;    ///< largest entry of the equation's remainder over the largest of its terms
};

/// A'X + XA - X b b' X / r + Q = 0 with A - b gain stable: ordered Schur form of the Hamiltonian matrix (Laub
/// 1979), then one Newton step (Kleinman). Throws ConfigError, naming and printing the matrix, when no such X
/// is there.
RiccatiSolution solve_continuous_riccati(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                                         const Eigen::MatrixXd& q, double r);

/// X = A'XA + Q - (A'Xb + s)(r + b'Xb)^-1(b'XA + s') for the cost x'Qx + 2 x's u + r u^2, with A - b gain
/// inside the unit circle: structure-preserving doubling (Chu, Fan, Lin, Wang 2004), which takes the singular
/// A of a delay line.
RiccatiSolution solve_discrete_riccati(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                                       const Eigen::MatrixXd& q, const Eigen::VectorXd& s, double r);

}  // namespace upright
