// The algebraic Riccati and Lyapunov equations of linear-quadratic design and of stationary Kalman filters.
#pragma once

#include <Eigen/Core>
#include <optional>

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

/// u = -gain x minimises the cost sum of x'Qx + 2 x'S u + u'R u.
struct DiscreteRiccatiSolution {
  Eigen::MatrixXd x;      ///< n x n, symmetric
  Eigen::MatrixXd gain;   ///< inputs x n
  double residual = 0.0;  ///< as above
};

/// X = A'XA + Q - (A'XB + S)(R + B'XB)^-1(B'XA + S') with A - B gain inside the unit circle:
/// structure-preserving doubling (Chu, Fan, Lin, Wang 2004), which takes the singular A of a delay line. With
/// (A', C') for (A, B) it is the equation of the stationary Kalman filter, X its covariance before a
/// measurement and gain' = A X C'(C X C' + R)^-1. Throws ConfigError as above.
DiscreteRiccatiSolution solve_discrete_riccati(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b,
                                               const Eigen::MatrixXd& q, const Eigen::MatrixXd& s,
                                               const Eigen::MatrixXd& r);

/// X = A'XA + Q for symmetric Q: the sum of A'^k Q A^k, doubled (Smith 1968). Absent where A has an
/// eigenvalue on or outside the unit circle.
std::optional<Eigen::MatrixXd> discrete_lyapunov(const Eigen::MatrixXd& a, const Eigen::MatrixXd& q);

}  // namespace upright
