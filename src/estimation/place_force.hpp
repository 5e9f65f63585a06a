// A force on the cart that belongs to the place: what the innovations of a fit say of it.
//
// The force is a piecewise linear curve through nodes along the track. A small curve changes the innovations
// e of the filter in proportion to its values a at the nodes:
//
//     e = S a + white noise of the innovation variances R
//
// S follows from the linearised steps of the fit, with the filter's own gains.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "upright/estimation/fit.hpp"

namespace upright {

/// Equidistant nodes along the track, in the position that the encoder shows.
struct TrackNodes {
  double first_m = 0.0;    ///< the first one
  double spacing_m = 1.0;  ///< from one to the next
  std::size_t count = 0;   ///< at least two
};

/// The normal equations of the forces at the nodes, for forces of zero. Initial states are eliminated.
struct PlaceForceEquations {
  Eigen::MatrixXd information;  ///< S' R^-1 S [1/N^2], count x count
  Eigen::VectorXd score;        ///< S' R^-1 e [1/N]
};

/// Follows the fit's filter over all segments. Throws Interrupted (parallel.hpp).
PlaceForceEquations place_force_equations(const FitData& data, const FitPoint& point,
                                          const TrackNodes& nodes);

}  // namespace upright
