// Rightmost roots of s' = A s + b V, V(t) = k s(t - delay): pseudospectral collocation of the delay
// equation's generator (Breda, Maset, Vermiglio 2005), polished by Newton's method on the characteristic
// function.
#pragma once

#include <Eigen/Core>
#include <complex>

namespace upright {

/// A single-input loop; the delay apart.
struct DelayedFeedback {
  Eigen::MatrixXd a;     ///< n x n
  Eigen::VectorXd b;     ///< n
  Eigen::RowVectorXd k;  ///< n
};

/// k (sI - A)^-1 b
std::complex<double> transfer(const DelayedFeedback& loop, std::complex<double> s);

/// The rightmost characteristic root [1/s]; `delay_s` >= 0.
std::complex<double> rightmost_root(const DelayedFeedback& loop, double delay_s);

}  // namespace upright
