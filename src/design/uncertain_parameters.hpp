// The parameters of a plant that may differ from those of its plant file.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "upright/model/plant.hpp"

namespace upright {

/// One parameter of a plant. A mass or a length of the pendulum carries the inertia along.
struct UncertainParameter {
  std::string
      name;  ///< name in plant files, after the section or the kind of effect: "motor force_per_volt_n"
  double value = 0.0;  ///< of the plant
  Range range;         ///< of plant files
  std::function<void(Plant&, double by)> scale;
  std::function<void(Plant&, double to)> set;  ///< of a plant in which this parameter has `value`
};

/// Mass of the cart; mass, length and inertia of the pendulum; the motor's two constants; and all values
/// of all effects.
std::vector<UncertainParameter> uncertain_parameters(const Plant& plant);

}  // namespace upright
