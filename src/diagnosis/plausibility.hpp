// What an effect or a correction can be: pure functions of fitted numbers.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "selection_policy.hpp"

namespace upright {

/// What a fit says of its parameters.
struct ParameterPosterior {
  Eigen::VectorXd value, prior_mean;
  Eigen::MatrixXd covariance;
};

/// The places of the parameters that are there once every correction which is not certain has been set back
/// to what was believed of it: the least certain first, and the others follow (a Gaussian approximation of
/// the likelihood). What is no correction stays.
std::vector<std::size_t> certain_parameters(ParameterPosterior posterior,
                                            const std::vector<bool>& is_correction,
                                            const SignificancePolicy& policy);

/// Whether a correction is still certain once all runs are fitted.
bool is_certain_of_all_runs(double certainty, const SignificancePolicy& policy);

/// A coefficient of the plant file that moved no further than such coefficients do from day to day: the
/// number is set right, but nothing was missing.
bool is_within_prior(double value, double prior_mean, double prior_sigma, const SignificancePolicy& policy);

/// Where a scale is at an end of what it may be, and stands for something else.
enum class EndOfRange { none, low, high };
EndOfRange end_of_range(double scale, double low, double high);
/// Relative to the end: far larger than the distance that the last step of a fit leaves.
inline constexpr double end_tolerance = 1e-3;

/// A number of the plant file that is off by more than a data sheet is.
bool is_doubtful(double scale, const PriorPolicy& policy);

/// An offset of the angle that its encoder shows. Of another sensor, `step_rad` is that of an encoder as
/// precise.
bool shows_on_encoder(double offset_rad, double step_rad, const CorrectionPolicy& policy);

/// Bristles that bend over a good part of the longest travel of one run before they slide are a spring by
/// another name.
bool are_bristles_short(double breakaway_n, double stiffness_n_per_m, double travel_m,
                        const PriorPolicy& policy);

/// Whether held-out runs are further off than what is left of all runs lets them be: both are `excess`, a
/// plain simulation over what noise makes of it at most.
bool is_held_out_too_far_off(double held_out_excess, double excess, const SignificancePolicy& policy);

}  // namespace upright
