// The parts of a controller that need a plant file, from the configuration that asks for them.
#pragma once

#include "upright/control/gain_file.hpp"
#include "upright/control/state_estimator.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// Reads the plant files that the configuration names. Throws ConfigError.
ModelParts make_model_parts(const ControlConfig& config);
/// The same with the plants given: the estimator's and the predictor's; each is used only where it is asked
/// for.
ModelParts make_model_parts(const ControlConfig& config, const Plant& estimated, const Plant& predicted);

}  // namespace upright
