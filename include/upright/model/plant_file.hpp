// Plant files (docs/reference/files.md): read strictly; written files read back exactly.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "upright/base/yaml_reader.hpp"
#include "upright/model/plant.hpp"

namespace upright {

/// An interval in which a number of a plant file lies with 95 percent confidence.
struct NumberInterval {
  std::string number;  ///< "cart_mass_kg", "motor.force_per_volt_n", "coulomb_friction.force_n", ...
  double low = 0.0;    ///< lower end
  double high = 0.0;   ///< upper end, not below `low`
};

/// Reads a plant file, also its intervals, which are not part of the plant. Throws ConfigError with
/// remedy, file, line and key.
Plant read_plant_file(const std::filesystem::path& file);

/// Reads only the intervals of a plant file; none without the key `intervals`.
std::vector<NumberInterval> read_plant_intervals(const std::filesystem::path& file);

/// Reads a plant from a parsed document, which holds the key `plant`.
Plant read_plant(const YamlMap& document);

/// The plant file as text, with `comments` as lines at its top.
std::string plant_text(const Plant& plant, const std::vector<std::string>& comments = {},
                       const std::vector<NumberInterval>& intervals = {});

/// Writes the plant file and replaces an existing one. Throws Error when it cannot be written.
void write_plant_file(const Plant& plant, const std::filesystem::path& file,
                      const std::vector<std::string>& comments = {},
                      const std::vector<NumberInterval>& intervals = {});

/// A value as it stands in a plant file: of a choice its word, else the number.
std::string value_text(const ParameterInfo& parameter, double value);

}  // namespace upright
