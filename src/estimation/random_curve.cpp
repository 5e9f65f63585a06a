#include "random_curve.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "model/dense_algebra.hpp"

namespace upright {

namespace {

/// Matern's correlation of smoothness 3/2 between the nodes.
Eigen::MatrixXd correlation(const CurveNodes& nodes, double length) {
  const auto n = static_cast<Eigen::Index>(nodes.count);
  Eigen::MatrixXd matrix(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const double d = std::numbers::sqrt3 * nodes.spacing * static_cast<double>(std::abs(i - j)) / length;
      matrix(i, j) = (1.0 + d) * std::exp(-d);
    }
  constexpr double regular = 1e-9;  // of the variance: keeps the factor regular
  matrix.diagonal().array() += regular;
  return matrix;
}

/// Independent values c of variance v that give the curve: a = L c at the nodes, in the axes in which what
/// the data say of c is uncorrelated as well.
struct PrincipalAxes {
  Eigen::MatrixXd values;  ///< at the nodes, by axis, for a unit of c
  Eigen::VectorXd information, score;

  PrincipalAxes(const CurveEquations& equations, const CurveNodes& nodes, double length) {
    const Eigen::MatrixXd factor = correlation(nodes, length).llt().matrixL();
    const SymmetricEigen axes = symmetric_eigen(factor.transpose() * equations.information * factor);
    values = factor * axes.vectors;
    information = axes.values.cwiseMax(0.0);
    score = values.transpose() * equations.score;
  }

  /// By how much minus twice the log likelihood changes if the curve is integrated out.
  double marginal_change(double variance) const {
    double change = 0.0;
    for (Eigen::Index i = 0; i < score.size(); ++i) {
      const double widened = 1.0 + variance * information[i];
      change += std::log(widened) - variance * score[i] * score[i] / widened;
    }
    return change;
  }
};

}  // namespace

RandomCurve::RandomCurve(const CurveEquations& equations, const CurveNodes& nodes) : nodes_(nodes) {
  const double range = nodes.spacing * static_cast<double>(nodes.count - 1);
  for (double length = nodes.spacing; length < range; length *= 2.0) {
    const PrincipalAxes axes(equations, nodes, length);
    const double largest = axes.information.maxCoeff();
    if (!(largest > 0.0)) return;
    // From a curve that the data cannot show to one that they show a million times over.
    for (double variance = 0.1 / largest; variance < 1e12 / largest; variance *= std::numbers::sqrt2)
      consider(variance, length, axes.marginal_change(variance));
  }
}

void RandomCurve::consider(double variance, double length, double change) {
  if (!(change < change_)) return;
  change_ = change;
  variance_ = variance;
  length_ = length;
}

double RandomCurve::deviation() const {
  return std::sqrt(variance_);
}

double RandomCurve::change_with(const CurveEquations& equations) const {
  return PrincipalAxes(equations, nodes_, length_).marginal_change(variance_);
}

double RandomCurve::effective_values(const CurveEquations& equations) const {
  const Eigen::ArrayXd shown = variance_ * PrincipalAxes(equations, nodes_, length_).information.array();
  return (shown / (1.0 + shown)).sum();
}

Eigen::VectorXd RandomCurve::mean(const CurveEquations& equations) const {
  const PrincipalAxes axes(equations, nodes_, length_);
  const Eigen::ArrayXd expected =
      variance_ * axes.score.array() / (1.0 + variance_ * axes.information.array());
  return axes.values * expected.matrix();
}

Eigen::MatrixXd RandomCurve::prior_information(const CurveNodes& nodes) const {
  const auto n = static_cast<Eigen::Index>(nodes.count);
  return solve_symmetric(correlation(nodes, length_), Eigen::MatrixXd::Identity(n, n)) / variance_;
}

}  // namespace upright
