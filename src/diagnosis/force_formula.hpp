// A short formula for a force that was drawn as a curve, where one fits the curve within its uncertainty.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "estimation/force_curve.hpp"

namespace upright {

/// The sum of the fewest of the terms 1, q, q|q| and q^3 that fits, as text such as "0.31 - 2.2 v|v| [N,
/// m/s]". `symbol`: of the quantity q; `unit`: of q. `force_n`: the curve at the nodes, `covariance`: of
/// these values. Empty if no such sum fits: its misfit must be within two standard deviations of what chance
/// gives.
std::optional<std::string> formula_of(const CurveNodes& nodes, const Eigen::VectorXd& force_n,
                                      const Eigen::MatrixXd& covariance, const std::string& symbol,
                                      const std::string& unit);

}  // namespace upright
