// A plot as a file of its own.
#pragma once

#include <filesystem>

#include "plot.hpp"

namespace upright {

/// Writes the plot as SVG. Throws ConfigError when the file cannot be written.
void save_picture(const Plot& plot, const std::filesystem::path& file);

}  // namespace upright
