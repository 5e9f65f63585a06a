// How well the data determine the free parameters.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace upright {

/// Covariance of the parameters, robust to noise that is not white (sandwich estimator): from the information
/// of likelihood and prior together, the scatter of the scores over segments, and the information of the
/// prior. `held`: whether each parameter is at a bound. Such a parameter is treated as fixed and adds no
/// uncertainty to the others.
Eigen::MatrixXd sandwich_covariance(const Eigen::MatrixXd& information, const Eigen::MatrixXd& spread,
                                    const Eigen::MatrixXd& prior, const std::vector<bool>& held);

/// How far from its bound each parameter that is there may be with 95 % confidence; zero for the others. Its
/// posterior is a normal density that is cut off at the bound, beyond which the data draw it. `information`
/// and `score` of likelihood and prior together, `dispersion` as below.
Eigen::VectorXd reach_from_bounds(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                                  double dispersion, const std::vector<bool>& held);

/// The scatter of the scores over segments relative to the information of the likelihood: the mean of
/// tr(H^-1 B) over the directions that hold information (the variance inflation factor of quasi-likelihood,
/// Wedderburn 1974). About 1 if the noise is as modelled; larger if it lasts or depends on the state. At
/// least 1.
double dispersion(const Eigen::MatrixXd& information, const Eigen::MatrixXd& spread);

}  // namespace upright
