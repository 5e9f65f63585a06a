// The response of a linear system at many frequencies: the state matrix is made triangular once (Schur form),
// after which each frequency costs n^2 operations instead of n^3 (Laub, IEEE Trans. Automatic Control 26
// (1981) 407, does it with the Hessenberg form).
#pragma once

#include <Eigen/Core>
#include <complex>

namespace upright {

class FrequencyResponse {
 public:
  FrequencyResponse() = default;
  /// `a`: n x n, of x' = a x + b u or x(k + 1) = a x(k) + b u(k); `b`: n x m, of the inputs; `c`: 1 x n, of
  /// the output. Throws ConfigError if `a` has no Schur form.
  FrequencyResponse(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, const Eigen::RowVectorXd& c);

  /// c (z I - a)^-1 b, 1 x m. Not finite where `z` is an eigenvalue of `a`.
  Eigen::RowVectorXcd at(std::complex<double> z) const;

 private:
  Eigen::MatrixXcd triangular_;  ///< u^H a u
  Eigen::MatrixXcd inputs_;      ///< u^H b
  Eigen::RowVectorXcd output_;   ///< c u
};

}  // namespace upright
