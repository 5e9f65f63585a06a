#include "parameter_covariance.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace upright {

namespace {

using Matrix = Eigen::MatrixXd;

/// Inverse of an information matrix. What holds no information at all is left out (zeros); combinations of
/// the others that hold none are as good as unknown.
Matrix inverse_of(const Matrix& h) {
  const Eigen::VectorXd scale =
      h.diagonal().unaryExpr([](double v) { return v > 1e-200 ? 1.0 / std::sqrt(v) : 0.0; });
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(scale.asDiagonal() * h * scale.asDiagonal());
  constexpr double min_eigenvalue = 1e-13;
  const Eigen::VectorXd inverse = solver.eigenvalues().cwiseMax(min_eigenvalue).cwiseInverse();
  return scale.asDiagonal() * solver.eigenvectors() * inverse.asDiagonal() *
         solver.eigenvectors().transpose() * scale.asDiagonal();
}

/// The scatter of the scores over segments, but in no direction less than the likelihood itself says: noise
/// that is whiter than it looks must not shrink an interval.
Matrix robust_spread(const Matrix& information, const Matrix& spread) {
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::VectorXd unscale = scale.cwiseInverse();
  Matrix unit = unscale.asDiagonal() * information * unscale.asDiagonal();
  unit.diagonal().array() += 1e-12;
  const Eigen::LLT<Matrix> root(unit);
  if (root.info() != Eigen::Success) return information;
  Matrix relative = root.matrixL().solve(Matrix(unscale.asDiagonal() * spread * unscale.asDiagonal()));
  relative = root.matrixL().solve(Matrix(relative.transpose()));
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(0.5 * (relative + relative.transpose()));
  const Eigen::VectorXd raised = solver.eigenvalues().cwiseMax(1.0);
  const Matrix half = scale.asDiagonal() * Matrix(root.matrixL()) * solver.eigenvectors();
  return half * raised.asDiagonal() * half.transpose();
}

Matrix without_held(Matrix h, const std::vector<bool>& held) {
  for (std::size_t j = 0; j < held.size(); ++j) {
    if (!held[j]) continue;
    const auto at = static_cast<Eigen::Index>(j);
    h.row(at).setZero();
    h.col(at).setZero();
  }
  return h;
}

/// Of a normal deviate that is known to be above `lowest`: by how much it is above it at most, with 95 %
/// confidence.
double reach_above(double lowest) {
  constexpr double share_above = 0.05, exponential_from = 30.0;
  // The tail is nearly exponential there.
  if (lowest > exponential_from) return -std::log(share_above) / lowest;
  const auto above = [](double deviate) { return std::erfc(deviate * std::numbers::sqrt2 / 2.0); };
  double low = 0.0, high = exponential_from;
  constexpr int halvings = 40;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    (above(lowest + middle) > share_above * above(lowest) ? low : high) = middle;
  }
  return high;
}

}  // namespace

Matrix sandwich_covariance(const Matrix& information, const Matrix& spread, const Matrix& prior,
                           const std::vector<bool>& held) {
  const Matrix inverse = inverse_of(without_held(information, held));
  return inverse * (robust_spread(information - prior, spread) + prior) * inverse;
}

Eigen::VectorXd reach_from_bounds(const Matrix& information, const Eigen::VectorXd& score, double dispersion,
                                  const std::vector<bool>& held) {
  Eigen::VectorXd reach = Eigen::VectorXd::Zero(score.size());
  if (std::find(held.begin(), held.end(), true) == held.end()) return reach;
  const Matrix of_others = inverse_of(without_held(information, held));
  for (Eigen::Index j = 0; j < score.size(); ++j) {
    if (!held[static_cast<std::size_t>(j)]) continue;
    // Those that are not held follow it.
    const double own = information(j, j) - information.col(j).dot(of_others * information.col(j));
    if (!(own > 0.0)) continue;
    const double sigma = std::sqrt(dispersion / own);
    reach[j] = sigma * reach_above(std::abs(score[j]) / own / sigma);
  }
  return reach;
}

double dispersion(const Matrix& information, const Matrix& spread) {
  const Eigen::VectorXd scale =
      information.diagonal().unaryExpr([](double v) { return v > 1e-200 ? 1.0 / std::sqrt(v) : 0.0; });
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(scale.asDiagonal() * information * scale.asDiagonal());
  constexpr double min_eigenvalue = 1e-9;
  double sum = 0.0, directions = 0.0;
  for (Eigen::Index i = 0; i < solver.eigenvalues().size(); ++i) {
    if (!(solver.eigenvalues()[i] > min_eigenvalue)) continue;
    const Eigen::VectorXd way = scale.cwiseProduct(solver.eigenvectors().col(i));
    sum += way.dot(spread * way) / solver.eigenvalues()[i];
    directions += 1.0;
  }
  return directions > 0.0 ? std::max(sum / directions, 1.0) : 1.0;
}

}  // namespace upright
