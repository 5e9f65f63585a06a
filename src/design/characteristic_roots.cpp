#include "characteristic_roots.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/dense_algebra.hpp"

namespace upright {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;

/// Differentiation on the Chebyshev points cos(pi i / count), i = 0 .. count, of [-1, 1] (Trefethen 2000).
MatrixXd chebyshev_differentiation(Index count) {
  const auto point = [count](Index i) {
    return std::cos(std::numbers::pi * static_cast<double>(i) / static_cast<double>(count));
  };
  const auto weight = [count](Index i) {
    return (i == 0 || i == count ? 2.0 : 1.0) * (i % 2 == 0 ? 1.0 : -1.0);
  };
  MatrixXd d = MatrixXd::Zero(count + 1, count + 1);
  for (Index i = 0; i <= count; ++i)
    for (Index j = 0; j <= count; ++j)
      if (i != j) d(i, j) = weight(i) / weight(j) / (point(i) - point(j));
  for (Index i = 0; i <= count; ++i) d(i, i) = -d.row(i).sum();
  return d;
}

Complex rightmost(const Eigen::VectorXcd& values) {
  Index at = 0;
  values.real().maxCoeff(&at);
  return {values(at).real(), std::abs(values(at).imag())};
}

/// The generator on polynomials of degree `count` over [-delay, 0]: the equation at 0, the derivative before
/// it.
MatrixXd generator(const DelayedFeedback& loop, double delay_s, Index count) {
  const Index n = loop.a.rows();
  const MatrixXd d = chebyshev_differentiation(count) * (2.0 / delay_s);
  MatrixXd matrix = MatrixXd::Zero(n * (count + 1), n * (count + 1));
  matrix.topLeftCorner(n, n) = loop.a;
  matrix.topRightCorner(n, n) += loop.b * loop.k;
  for (Index i = 1; i <= count; ++i)
    for (Index j = 0; j <= count; ++j) matrix.block(i * n, j * n, n, n).diagonal().setConstant(d(i, j));
  return matrix;
}

/// One root of 1 = G(s) e^(-s delay) from a guess near it; the guess itself where Newton leaves it.
Complex polished(const DelayedFeedback& loop, double delay_s, Complex guess) {
  const auto f = [&](Complex s) { return 1.0 - transfer(loop, s) * std::exp(-s * delay_s); };
  Complex s = guess;
  constexpr int max_steps = 20;
  for (int i = 0; i < max_steps; ++i) {
    const double aside = 1e-6 * (1.0 + std::abs(s));
    const Complex slope = (f(s + aside) - f(s - aside)) / (2.0 * aside);
    const Complex step = f(s) / slope;
    s -= step;
    if (std::abs(step) < 1e-13 * (1.0 + std::abs(s))) break;
  }
  const bool near = std::abs(s - guess) < 1e-3 * (1.0 + std::abs(guess));
  return near ? s : guess;
}

}  // namespace

Complex transfer(const DelayedFeedback& loop, Complex s) {
  Eigen::MatrixXcd m = -loop.a.cast<Complex>();
  m.diagonal().array() += s;
  const Eigen::VectorXcd response = solve(m, loop.b.cast<Complex>());
  return (loop.k.cast<Complex>() * response)(0);
}

Complex rightmost_root(const DelayedFeedback& loop, double delay_s) {
  if (delay_s <= 0.0) return rightmost(eigenvalues(loop.a + loop.b * loop.k));
  // Enough points for the oscillations that the loop's own rates fit into the delay.
  const double rate = eigenvalues(loop.a + loop.b * loop.k).cwiseAbs().maxCoeff();
  const auto count = static_cast<Index>(std::clamp(16.0 + rate * delay_s, 16.0, 80.0));
  return polished(loop, delay_s, rightmost(eigenvalues(generator(loop, delay_s, count))));
}

}  // namespace upright
