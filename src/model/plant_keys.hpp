// The keys of a plant file, for the reader, the writer and the schema.
#pragma once

#include "base/yaml_keys.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

/// What a plant file holds.
struct PlantFile {
  Plant plant;
  std::vector<NumberInterval> intervals;
};

/// Visits the keys of a plant.
void plant_keys(YamlKeys& document, Plant& plant);
/// Visits the keys of the whole file.
void plant_file_keys(YamlKeys& document, PlantFile& file);

}  // namespace upright
