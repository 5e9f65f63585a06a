#include "riccati.hpp"

#include <Eigen/Jacobi>
#include <algorithm>
#include <complex>
#include <optional>

#include "dense_algebra.hpp"
#include "linear_plant.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ComplexMatrix = Eigen::MatrixXcd;

/// Exchanges the diagonal entries k and k + 1 of the triangular factor by one rotation.
void exchange(SchurForm& schur, Index k) {
  Eigen::JacobiRotation<std::complex<double>> rotation;
  rotation.makeGivens(schur.t(k, k + 1), schur.t(k + 1, k + 1) - schur.t(k, k));
  schur.t.applyOnTheLeft(k, k + 1, rotation.adjoint());
  schur.t.applyOnTheRight(k, k + 1, rotation);
  schur.u.applyOnTheRight(k, k + 1, rotation);
  schur.t(k + 1, k) = 0.0;
}

/// Schur form with the eigenvalues of the left half plane first; returns how many they are.
Index order_stable_first(SchurForm& schur) {
  Index stable = 0;
  for (Index i = 0; i < schur.t.rows(); ++i) {
    if (!(schur.t(i, i).real() < 0.0)) continue;
    for (Index k = i; k > stable; --k) exchange(schur, k - 1);
    ++stable;
  }
  return stable;
}

MatrixXd symmetric_part(const MatrixXd& m) {
  return 0.5 * (m + m.transpose());
}

/// F'X + XF + W = 0 through the Kronecker product: the systems here have a handful of states.
MatrixXd solve_lyapunov(const MatrixXd& f, const MatrixXd& w) {
  const Index n = f.rows();
  MatrixXd system = MatrixXd::Zero(n * n, n * n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) {
      system.block(i * n, j * n, n, n) += f(j, i) * MatrixXd::Identity(n, n);
      if (i == j) system.block(i * n, i * n, n, n) += f.transpose();
    }
  const VectorXd right = -Eigen::Map<const VectorXd>(w.data(), n * n);
  const VectorXd solution = solve(system, right);
  return symmetric_part(Eigen::Map<const MatrixXd>(solution.data(), n, n));
}

double relative(const MatrixXd& remainder, std::initializer_list<double> terms) {
  const double largest = std::max(terms);
  return remainder.cwiseAbs().maxCoeff() / std::max(largest, std::numeric_limits<double>::min());
}

void finish_continuous(RiccatiSolution& solution, const MatrixXd& a, const VectorXd& b, const MatrixXd& q,
                       double r) {
  const MatrixXd& x = solution.x;
  solution.gain = b.transpose() * x / r;
  const MatrixXd linear = a.transpose() * x + x * a;
  const MatrixXd square = solution.gain.transpose() * r * solution.gain;
  solution.residual = relative(linear - square + q, {linear.cwiseAbs().maxCoeff(),
                                                     square.cwiseAbs().maxCoeff(), q.cwiseAbs().maxCoeff()});
}

[[noreturn]] void refuse(const MatrixXd& a, const MatrixXd& b, const MatrixXd& q, const std::string& why) {
  throw ConfigError(why + ", " + matrix_text("A", a) + ", " + matrix_text("b", b) + ", " +
                    matrix_text("Q", q) + ": correct the plant or the weights");
}

void check(const MatrixXd& a, const MatrixXd& b, const MatrixXd& q, const MatrixXd& r) {
  if (!a.allFinite()) refuse(a, b, q, "the matrix A has an entry that is not finite");
  if (!b.allFinite()) refuse(a, b, q, "the matrix b has an entry that is not finite");
  if (!q.allFinite()) refuse(a, b, q, "the matrix Q has an entry that is not finite");
  if (!(r.diagonal().minCoeff() > 0.0)) refuse(a, b, q, "the weight r must be above 0");
}

}  // namespace

RiccatiSolution solve_continuous_riccati(const MatrixXd& a, const VectorXd& b, const MatrixXd& q, double r) {
  check(a, b, q, MatrixXd::Constant(1, 1, r));
  const Index n = a.rows();
  MatrixXd hamiltonian(2 * n, 2 * n);
  hamiltonian << a, -b * b.transpose() / r, -q, -a.transpose();
  std::optional<SchurForm> schur = schur_form(hamiltonian);
  constexpr double on_the_axis = 1e-13;
  const double nearest = on_the_axis * hamiltonian.cwiseAbs().maxCoeff();
  if (!schur || order_stable_first(*schur) != n || schur->t.diagonal().real().cwiseAbs().minCoeff() < nearest)
    refuse(a, b, q,
           "the matrix pair (A, b) is not stabilizable or (A, Q) is not detectable, so the Hamiltonian "
           "matrix has eigenvalues on the imaginary axis");
  const ComplexMatrix top = schur->u.topLeftCorner(n, n), bottom = schur->u.bottomLeftCorner(n, n);
  const ComplexMatrix x = solve_from_right(top, bottom);
  RiccatiSolution solution;
  solution.x = symmetric_part(x.real());
  finish_continuous(solution, a, b, q, r);
  const MatrixXd closed = a - b * solution.gain;
  solution.x = solve_lyapunov(closed, q + solution.gain.transpose() * r * solution.gain);
  finish_continuous(solution, a, b, q, r);
  if (!solution.x.allFinite()) refuse(a, b, q, "the matrix X of the Riccati equation is not finite");
  return solution;
}

DiscreteRiccatiSolution solve_discrete_riccati(const MatrixXd& a, const MatrixXd& b, const MatrixXd& q,
                                               const MatrixXd& s, const MatrixXd& r) {
  check(a, b, q, r);
  const Index n = a.rows();
  MatrixXd f = a - b * solve_symmetric(r, s.transpose());
  MatrixXd g = symmetric_part(b * solve_symmetric(r, b.transpose()));
  MatrixXd h = symmetric_part(q - s * solve_symmetric(r, s.transpose()));
  constexpr int max_doublings = 60;
  constexpr double converged = 1e-15;
  bool done = false;
  MatrixXd right(n, 2 * n);
  for (int i = 0; i < max_doublings && !done; ++i) {
    right << f, g;
    const MatrixXd both = solve(MatrixXd(MatrixXd::Identity(n, n) + g * h), right);
    const MatrixXd w_f = both.leftCols(n), w_g = both.rightCols(n);
    const MatrixXd grown = f.transpose() * h * w_f;
    done = grown.cwiseAbs().maxCoeff() <= converged * h.cwiseAbs().maxCoeff();
    g = symmetric_part(g + f * w_g * f.transpose());
    h = symmetric_part(h + grown);
    f = f * w_f;
    if (!h.allFinite()) break;
  }
  if (!done) refuse(a, b, q, "the matrix pair (A, b) is not stabilizable, or (A, Q) is not detectable");
  DiscreteRiccatiSolution solution;
  solution.x = h;
  const MatrixXd cross = b.transpose() * h * a + s.transpose();
  solution.gain = solve_symmetric(r + b.transpose() * h * b, cross);
  const MatrixXd moved = a.transpose() * h * a;
  const MatrixXd remainder = moved + q - cross.transpose() * solution.gain - h;
  solution.residual =
      relative(remainder, {moved.cwiseAbs().maxCoeff(), h.cwiseAbs().maxCoeff(), q.cwiseAbs().maxCoeff()});
  return solution;
}

std::optional<MatrixXd> discrete_lyapunov(const MatrixXd& a, const MatrixXd& q) {
  MatrixXd power = a, sum = q;
  constexpr int max_doublings = 60;
  constexpr double converged = 1e-15;
  for (int i = 0; i < max_doublings && power.allFinite() && sum.allFinite(); ++i) {
    const MatrixXd more = power.transpose() * sum * power;
    sum = symmetric_part(sum + more);
    power = (power * power).eval();
    if (more.cwiseAbs().maxCoeff() <= converged * sum.cwiseAbs().maxCoeff() &&
        power.cwiseAbs().maxCoeff() < 1.0)
      return sum;
  }
  return std::nullopt;
}

}  // namespace upright
