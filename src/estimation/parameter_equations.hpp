// The linearised equations of the parameters, segment by segment.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fit.hpp"

namespace upright {

/// What one segment says of the parameters near a point, with its initial state eliminated: a step d of the
/// parameters changes minus twice its log likelihood by d' information d - 2 score' d.
struct ParameterEquations {
  Eigen::MatrixXd information;  ///< free parameters x free parameters
  Eigen::VectorXd score;        ///< in the order of the free parameters
};

/// Of each segment of the data. Priors are not in it.
std::vector<ParameterEquations> parameter_equations(const FitData& data, const FitPoint& point,
                                                    const std::vector<FreeParameter>& free);

}  // namespace upright
