// A gain file with a Kalman filter, stationary or extended: gains for the sliding plant, since the estimated
// force takes the friction away, and a filter that tolerates an actuator slower than its model.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "gain_design.hpp"
#include "parameter_trials.hpp"
#include "upright/control/gain_file.hpp"
#include "widened_margin.hpp"

namespace upright {

/// What `--estimator` designs with where `--q` and `--r` do not say otherwise. Half the weight on the
/// position of the paper's, and less on the angle: lower gains tolerate a slower actuator, and the estimated
/// force, not the gain, keeps the cart in its place.
inline constexpr DesignWeights quiet_weights{{2250.0, 2500.0, 10.0, 20.0}, 1.0};

/// How much slower an actuator may be than its model [s], sampled and sliding: about what a servo
/// amplifier and its link add.
inline constexpr double slow_actuator_s = 0.005;

/// By how much the parameters may be off without the loop becoming unstable, where nobody says: what a
/// careful identification leaves.
inline constexpr double parameter_uncertainty = 0.05;

/// By how much more than the optimal gains those for a delay may cost, where nobody says (GainCost::loss).
inline constexpr double accepted_cost_loss = 0.3;

struct EstimatorRequest {
  StateEstimatorKind kind = StateEstimatorKind::kalman;
  std::filesystem::path plant_file;
  DesignWeights weights = quiet_weights;
  double smoothing = 100.0;
  double rate_hz = 1000.0;
  std::optional<double> delay_s;          ///< of the loop: with a predictor
  std::optional<double> for_delay_s;      ///< of the loop: without one
  double cost_loss = accepted_cost_loss;  ///< for `for_delay_s`
  double uncertainty = parameter_uncertainty;
};

struct EstimatorDesign {
  SampledDesign gains;
  ControlConfig config;
  double delay_margin_s = 0.0;             ///< in the delay line, sampled and sliding
  double unmodelled_delay_margin_s = 0.0;  ///< in the actuator, on top of the gain file's
  /// Runs on the plant with its friction; none with a predictor, whose horizon is judged by its margin.
  std::optional<ParameterTrials> trials;
  std::optional<WidenedMargin> widened;  ///< for a delay without a predictor
};

/// Throws ConfigError when no force noise makes a loop that holds the plant, or when it does not hold with
/// the parameters off by the uncertainty; names the parameter that it is sensitive to.
EstimatorDesign design_with_estimator(const Plant& plant, const EstimatorRequest& request);

/// Name and share of the first of the base parameters which, off by `uncertainty` one way or the other, makes
/// the sliding loop unstable while the estimator keeps its model; empty where none does.
std::string destabilising_parameter(const Plant& plant, const ControlConfig& config, double uncertainty);

}  // namespace upright
