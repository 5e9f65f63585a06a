// Estimates as beliefs: a Gaussian prior from a mean and a covariance.
#pragma once

#include <Eigen/Core>

#include "estimation/fit.hpp"

namespace upright {

/// The Gaussian with this mean and covariance. A parameter without variance is believed to be where it is,
/// within `min_sigma`. Nearly the same force twice makes a covariance singular; the rounding of that does
/// not become a belief in the impossible.
GaussianPrior belief_of(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance,
                        const Eigen::VectorXd& min_sigma);

}  // namespace upright
