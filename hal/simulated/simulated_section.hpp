// Section `simulated` of a rig file, read and written.
#pragma once

#include <string>

#include "upright/base/yaml_reader.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// Throws ConfigError with remedy, file, line and key.
SimulatedRig read_simulated(const YamlMap& map);

std::string simulated_text(const SimulatedRig& rig);

}  // namespace upright
