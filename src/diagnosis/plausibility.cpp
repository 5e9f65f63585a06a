#include "plausibility.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace upright {

namespace {

/// Sets the parameter at `place` back to what was believed of it, and takes it out: the others follow.
void set_back(ParameterPosterior& posterior, Eigen::Index place) {
  const double step = posterior.prior_mean[place] - posterior.value[place];
  const Eigen::VectorXd column =
      posterior.covariance.col(place) / std::max(posterior.covariance(place, place), 1e-300);
  posterior.value += column * step;
  posterior.covariance -= column * posterior.covariance.row(place).eval();
  std::vector<Eigen::Index> others;
  for (Eigen::Index i = 0; i < posterior.value.size(); ++i)
    if (i != place) others.push_back(i);
  const Eigen::MatrixXd covariance = posterior.covariance(others, others);
  posterior = {posterior.value(others).eval(), posterior.prior_mean(others).eval(), covariance};
}

}  // namespace

std::vector<std::size_t> certain_parameters(ParameterPosterior posterior,
                                            const std::vector<bool>& is_correction,
                                            const SignificancePolicy& policy) {
  std::vector<std::size_t> open(is_correction.size());
  std::iota(open.begin(), open.end(), std::size_t{0});
  for (;;) {
    double min_z = std::numeric_limits<double>::infinity();
    std::size_t place = 0;
    for (std::size_t a = 0; a < open.size(); ++a) {
      if (!is_correction[open[a]]) continue;
      const auto at = static_cast<Eigen::Index>(a);
      const double z = std::abs(posterior.value[at] - posterior.prior_mean[at]) /
                       std::sqrt(std::max(posterior.covariance(at, at), 1e-300));
      if (z < min_z) {
        min_z = z;
        place = a;
      }
    }
    if (!(min_z < policy.certain_z)) return open;
    set_back(posterior, static_cast<Eigen::Index>(place));
    open.erase(open.begin() + static_cast<std::ptrdiff_t>(place));
  }
}

bool is_certain_of_all_runs(double certainty, const SignificancePolicy& policy) {
  return !(certainty < policy.interval_z);
}

bool is_within_prior(double value, double prior_mean, double prior_sigma, const SignificancePolicy& policy) {
  return std::abs(value - prior_mean) < policy.noticeable_z * prior_sigma;
}

EndOfRange end_of_range(double scale, double low, double high) {
  if (scale < low * (1.0 + end_tolerance)) return EndOfRange::low;
  if (scale < high * (1.0 - end_tolerance)) return EndOfRange::none;
  return EndOfRange::high;
}

bool is_doubtful(double scale, const PriorPolicy& policy) {
  return !(std::abs(std::log(scale)) < policy.doubtful_scale);
}

bool shows_on_encoder(double offset_rad, double step_rad, const CorrectionPolicy& policy) {
  return !(std::abs(offset_rad) < policy.min_angle_offset_steps * step_rad);
}

bool are_bristles_short(double breakaway_n, double stiffness_n_per_m, double travel_m,
                        const PriorPolicy& policy) {
  return breakaway_n < stiffness_n_per_m * policy.bristle_share_of_travel * travel_m;
}

bool is_held_out_too_far_off(double held_out_excess, double excess, const SignificancePolicy& policy) {
  return held_out_excess > policy.clear_ratio * std::max(1.0, excess);
}

}  // namespace upright
