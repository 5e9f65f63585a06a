// A force on the cart that is a curve over some quantity: what the innovations of a fit say of it.
//
// The curve is piecewise linear through nodes. A small curve changes the innovations e of the filter in
// proportion to its values a at the nodes:
//
//     e = S a + white noise of the innovation variances R
//
// S follows from the linearised steps of the fit, with the filter's own gains.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "fit.hpp"

namespace upright {

/// Equidistant nodes of a curve.
struct CurveNodes {
  double first = 0.0;     ///< where the first one lies, in the unit of the quantity
  double spacing = 1.0;   ///< from one to the next
  std::size_t count = 0;  ///< at least two
};

/// How a curve acts along a segment: the force from each sample to the next is the factor times the curve.
struct CurveArgument {
  std::vector<double> at;      ///< the quantity, by sample; empty: no such force acts here
  std::vector<double> factor;  ///< by sample; empty: 1
};

/// The position that the encoder shows, by segment. No curve acts where the cart is held.
std::vector<CurveArgument> shown_places(const FitData& data);

/// The normal equations of the values at the nodes, for a curve of zero. Initial states are eliminated.
struct CurveEquations {
  Eigen::MatrixXd information;  ///< S' R^-1 S, count x count
  Eigen::VectorXd score;        ///< S' R^-1 e
};

/// Follows the fit's filter over all segments. `steps`: linearised at the fit, `arguments`: one per segment.
/// Throws Interrupted (parallel.hpp).
CurveEquations curve_equations(const std::vector<std::vector<LinearStep>>& steps, const CurveNodes& nodes,
                               const std::vector<CurveArgument>& arguments);

}  // namespace upright
