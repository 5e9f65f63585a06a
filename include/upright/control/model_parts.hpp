// The model-based parts of a controller, made from the configuration that requires them.
#pragma once

#include "upright/control/gain_file.hpp"
#include "upright/control/state_estimator.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// Reads the plant files that the configuration names. Throws ConfigError.
ModelParts make_model_parts(const ControlConfig& config);
/// The same with given plants for the estimator and the predictor; each plant is used only where the
/// configuration requires it.
ModelParts make_model_parts(const ControlConfig& config, const Plant& estimated, const Plant& predicted);

}  // namespace upright
