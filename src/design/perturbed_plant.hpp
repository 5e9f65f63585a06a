// A plant with perturbed parameters, for testing the robustness of a controller.
#pragma once

#include "upright/model/plant.hpp"

namespace upright {

/// All parameters of `plant` (with a pendulum) increased or decreased by the relative amount `share`,
/// with signs from a generator with this seed: equal on every machine. Gravity is unchanged.
Plant perturbed_plant(Plant plant, unsigned seed, double share);

}  // namespace upright
