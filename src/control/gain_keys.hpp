// The keys of a gain file, for the reader and the schema.
#pragma once

#include "base/yaml_keys.hpp"
#include "upright/control/gain_file.hpp"

namespace upright {

/// Visits the keys of the whole file.
void gain_keys(YamlKeys& document, ControlConfig& config);

}  // namespace upright
