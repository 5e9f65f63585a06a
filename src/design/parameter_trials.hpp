// Sensitivity of a designed loop to the parameters of its plant.
#pragma once

#include <string>

#include "upright/control/gain_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// Results of simulated runs from 3 degrees over some seconds, with encoders and the plant's own
/// friction, while the estimator uses the plant file.
struct ParameterTrials {
  int runs = 0, fell = 0;
  bool one_alone_falls = false;    ///< with one parameter perturbed
  double hunting_m = 0.0;          ///< cart, peak to peak over the last third, with the unperturbed plant
  double largest_hunting_m = 0.0;  ///< over all runs without a fall
  /// Name and error of the first parameter that alone causes a fall, else of that with most hunting.
  std::string most_sensitive_to;
};

/// Perturbs each parameter alone by `uncertainty` in both directions, then makes `together` runs with all
/// of them perturbed at random. Reads no file. Throws ConfigError when the loop cannot be run.
ParameterTrials try_parameters(const Plant& plant, const ControlConfig& config, double uncertainty,
                               int together);

}  // namespace upright
