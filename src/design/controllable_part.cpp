#include "controllable_part.hpp"

#include <cmath>
#include <cstdio>
#include <optional>

#include "model/dense_algebra.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// What is left of a direction, relative to the matrix, when it lies in the subspace already.
constexpr double in_the_subspace = 1e-11;

/// Orthonormal basis of span{b, Ab, A^2 b, ...}.
MatrixXd krylov_basis(const MatrixXd& a, const VectorXd& b) {
  const Index n = a.rows();
  MatrixXd basis(n, 0);
  VectorXd next = b;
  double scale = b.norm();
  while (basis.cols() < n && scale > 0.0) {
    for (int pass = 0; pass < 2; ++pass) next -= basis * (basis.transpose() * next);
    if (next.norm() <= in_the_subspace * scale) break;
    basis.conservativeResize(Eigen::NoChange, basis.cols() + 1);
    basis.rightCols<1>() = next.normalized();
    next = a * basis.rightCols<1>();
    scale = a.norm();
  }
  return basis;
}

[[noreturn]] void refuse(const LinearPlant& linear, const std::string& why) {
  throw ConfigError(why + " (the matrix pair (A, b) is not stabilizable), " + matrix_text("A", linear.a) +
                    ", " + matrix_text("b", linear.b) + ": correct the plant");
}

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

/// "1 cart_m - 0.5 theta_rad"
std::string combination(const Eigen::RowVectorXd& weights, const std::vector<std::string>& names) {
  std::string text;
  for (Index i = 0; i < weights.size(); ++i) {
    if (std::abs(weights(i)) < 1e-9) continue;
    text += text.empty() ? (weights(i) < 0.0 ? "-" : "") : (weights(i) < 0.0 ? " - " : " + ");
    text += short_number(std::abs(weights(i))) + " " + names[static_cast<std::size_t>(i)];
  }
  return text.empty() ? "0" : text;
}

std::complex<double> largest_eigenvalue(const MatrixXd& matrix) {
  const Eigen::VectorXcd values = eigenvalues(matrix);
  Index at = 0;
  values.real().maxCoeff(&at);
  return values(at);
}

void explain(const LinearPlant& linear, ControllablePart& part, std::complex<double> eigenvalue) {
  for (std::size_t i = part.states.size(); i < linear.states.size(); ++i) {
    const std::string& state = linear.states[i];
    const std::string motion = std::abs(eigenvalue) < 1e-9 ? "a constant"
                                                           : "a part that decays by itself at " +
                                                                 short_number(eigenvalue.real()) + " 1/s";
    part.eliminated.push_back(
        {state, eigenvalue,
         state + " = " + combination(part.follow.row(static_cast<Index>(i)), part.states) + " + " + motion +
             " that the voltage cannot move; the gains are those of the stabilizable part, where this state "
             "follows the others"});
  }
}

}  // namespace

ControllablePart controllable_part(const LinearPlant& linear) {
  const Index n = linear.a.rows();
  const MatrixXd basis = krylov_basis(linear.a, linear.b);
  const Index r = basis.cols();
  const auto fed_back = static_cast<Index>(linear.fed_back.size());
  if (r < fed_back) refuse(linear, "the voltage does not affect every state that is fed back");
  ControllablePart part;
  part.states.assign(linear.states.begin(), linear.states.begin() + r);
  const std::optional<MatrixXd> kept_inverse = inverse_if_regular(basis.topRows(r), in_the_subspace);
  if (!kept_inverse) refuse(linear, "the voltage does not affect every state that is fed back");
  part.follow = basis * *kept_inverse;
  part.follow.topRows(r).setIdentity();
  part.a = (linear.a * part.follow).topRows(r);
  part.b = linear.b.head(r);
  if (r == n) return part;
  const MatrixXd whole = completed_basis(basis);
  const MatrixXd rest = whole.rightCols(n - r);
  const std::complex<double> eigenvalue = largest_eigenvalue(rest.transpose() * linear.a * rest);
  if (eigenvalue.real() > 1e-9 * linear.a.norm())
    refuse(linear, "a mode that the voltage does not affect is unstable (eigenvalue " +
                       short_number(eigenvalue.real()) + " 1/s)");
  explain(linear, part, eigenvalue);
  return part;
}

}  // namespace upright
