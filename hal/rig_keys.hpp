// The keys of a rig file with their ranges and defaults, for the reader, the writer and the check of the
// reference.
#pragma once

#include "base/yaml_keys.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// Visits the keys of the whole file, of every backend that `rig` uses.
void rig_keys(YamlKeys& document, RigFile& rig);

}  // namespace upright
