// The section `gpio` of a rig file.
#pragma once

#include "base/yaml_keys.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// Visits the section, which must be there to be read and is written where the rig has one.
void gpio_keys(YamlKeys& document, RigFile& rig);

}  // namespace upright
