// Is what is left noise, or something that is not in the model? Noise that no model needs to explain is the
// same all along (stationary) and has nothing to do with the state. Two tests on held-in and held-out data
// together:
// - dispersion: the whitened innovations of short blocks are as large everywhere as chance allows, and the
// residual force
//   has no heavier tails than chance gives it;
// - dependence: a ridge regression of the residual force and torque on velocity, its sign, position, voltage,
// time and the
//   time since the last reversals predicts nothing on segments it has not seen.
#pragma once

#include <string>
#include <vector>

#include "upright/analysis/diagnosis.hpp"

namespace upright {

struct ResidualStructure {
  double noise_ratio = 1.0;      ///< rms of a plain simulation's residual over the sensors' noise
  double dispersion = 1.0;       ///< 95th percentile of block rms over its median
  double force_tails = 3.0;      ///< kurtosis of the residual force while the cart moves
  double force_explained = 0.0;  ///< cross-validated share of the residual force's variance
  double torque_explained = 0.0;
  std::string force_feature, torque_feature;  ///< what it goes with most
  bool structured = false;
  std::string sentence;
};

/// Examines what a fit leaves at `point`.
ResidualStructure examine_residuals(const FitData& data, const FitPoint& point);

}  // namespace upright
