// The keys of a plant file, for the reader, the writer and the schema.
#pragma once

#include "base/yaml_keys.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// Visits the keys of the whole file.
void plant_keys(YamlKeys& document, Plant& plant);

}  // namespace upright
