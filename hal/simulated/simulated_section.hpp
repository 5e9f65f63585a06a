// The keys of section `simulated` of a rig file.
#pragma once

#include "base/yaml_keys.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

void simulated_keys(YamlKeys& keys, SimulatedRig& rig);

}  // namespace upright
