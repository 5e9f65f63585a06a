// A Gaussian random curve: the size and correlation length that the data give it, and the curve itself.
//
// The values a at the nodes have variance v and Matern's correlation of smoothness 3/2 (Rasmussen, Williams,
// Gaussian Processes for Machine Learning, 2006, eq. 4.17). With the equations of force_curve.hpp they are
// integrated out, and v and the correlation length maximise the marginal likelihood.
#pragma once

#include <Eigen/Core>

#include "force_curve.hpp"

namespace upright {

/// The random curve of these equations. Values are in the unit of the curve, lengths in that of the quantity.
class RandomCurve {
 public:
  RandomCurve(const CurveEquations& equations, const CurveNodes& nodes);

  /// Whether there is any: a curve of zero is not the most likely one.
  bool is_there() const { return variance_ > 0.0; }
  /// Of minus twice the log marginal likelihood, at the fit that it was estimated at; not above zero.
  double change() const { return change_; }
  /// Standard deviation of a value.
  double deviation() const;
  /// Correlation length.
  double length() const { return length_; }

  /// How many independent values of it the data show, in effect: the trace of the matrix that turns the data
  /// into the curve (Hastie, Tibshirani, Friedman, The Elements of Statistical Learning, 2009, eq. 5.16).
  double effective_values(const CurveEquations& equations) const;
  /// The same change with other equations, with the size and the length held.
  double change_with(const CurveEquations& equations) const;
  /// The expected values at the nodes, from these equations and the prior.
  Eigen::VectorXd mean(const CurveEquations& equations) const;
  /// Inverse of the prior covariance of its values at these nodes.
  Eigen::MatrixXd prior_information(const CurveNodes& nodes) const;

 private:
  void consider(double variance, double length, double change);

  CurveNodes nodes_;
  double variance_ = 0.0, length_ = 1.0, change_ = 0.0;
};

}  // namespace upright
