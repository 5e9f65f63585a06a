// A segment followed by the extended Kalman filter and linearised along its trajectory, with the normal
// equations of its initial state and of the free parameters.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "extended_kalman_filter.hpp"
#include "fit.hpp"

namespace upright {

/// Whitened normal equations of one segment: initial state first, then parameters.
struct NormalEquations {
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
  Likelihood likelihood;
  std::vector<double> blocks;  ///< its objective, in blocks of time
};

struct LinearisedSegment {
  std::vector<LinearStep> steps;
  NormalEquations normal;
};

/// Linearises segment number `s` of the data. Without free parameters `normal` may be null; then only the
/// steps are computed. A residual that is not finite ends it with an infinite likelihood.
void linearise_segment(const FitData& data, std::size_t s, const FitPoint& point,
                       const std::vector<FreeParameter>& free, std::vector<LinearStep>& steps,
                       NormalEquations* normal);

}  // namespace upright
