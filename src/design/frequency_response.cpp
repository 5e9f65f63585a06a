#include "frequency_response.hpp"

#include "model/dense_algebra.hpp"
#include "upright/base/error.hpp"

namespace upright {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;

FrequencyResponse::FrequencyResponse(const MatrixXd& a, const MatrixXd& b, const Eigen::RowVectorXd& c) {
  const std::optional<SchurForm> schur = schur_form(a);
  if (!schur)
    throw ConfigError("the matrix of the loop has no Schur form: check the numbers of plant and gains");
  triangular_ = schur->t;
  inputs_ = schur->u.adjoint() * b.cast<Complex>();
  output_ = c.cast<Complex>() * schur->u;
}

Eigen::RowVectorXcd FrequencyResponse::at(Complex z) const {
  const Index n = triangular_.rows();
  Eigen::VectorXcd adjoint(n);  // c u (z I - t)^-1, by forward substitution
  for (Index j = 0; j < n; ++j) {
    const Complex known = adjoint.head(j).cwiseProduct(triangular_.col(j).head(j)).sum();
    adjoint(j) = (output_(j) + known) / (z - triangular_(j, j));
  }
  return adjoint.transpose() * inputs_;
}

}  // namespace upright
