// Writes a plant as an FMU: FMI 2.0, co-simulation, for Linux on x86-64.
#pragma once

#include <filesystem>
#include <string>

#include "upright/model/plant.hpp"

namespace upright {

/// `name`: of the model; letters, digits and underscores in it make the name of its library. The pendulum
/// hangs at rest at the start unless the importer sets another state. Throws ConfigError when it cannot be
/// written.
void write_fmu(const Plant& plant, const std::string& name, const std::filesystem::path& file);

}  // namespace upright
