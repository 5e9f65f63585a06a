// A plant whose numbers are not quite those of its file: which of them a designed loop is sensitive to.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "upright/control/gain_file.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// One number of a plant, and how to multiply it.
struct UncertainParameter {
  std::string name;  ///< as the plant file calls it
  std::function<void(Plant&, double by)> scale;
};

/// Mass of the cart; mass, length and inertia of the pendulum; the motor's two; and every value of every
/// effect.
std::vector<UncertainParameter> uncertain_parameters(const Plant& plant);

/// What simulated runs said, each from 3 degrees for some seconds, with encoders and the plant's own friction
/// while the estimator believes the plant file.
struct ParameterTrials {
  int runs = 0, fell = 0;
  bool one_alone_falls = false;    ///< with one parameter off and the others right
  double hunting_m = 0.0;          ///< cart, peak to peak over the last third, with the plant as in its file
  double largest_hunting_m = 0.0;  ///< of all runs that did not fall
  /// Name and error of the first parameter that makes the loop fall by itself, or hunt most where none does.
  std::string most_sensitive_to;
};

/// Each parameter off by `uncertainty` up and down, alone, then `together` runs with all of them off at once,
/// each up or down. Reads no file. Throws ConfigError when the loop cannot be run.
ParameterTrials try_parameters(const Plant& plant, const ControlConfig& config, double uncertainty,
                               int together);

}  // namespace upright
