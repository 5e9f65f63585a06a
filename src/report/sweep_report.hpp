// The report of a sweep: the map of outcomes over delay and starting angle, and where they change.
#pragma once

#include <filesystem>

namespace upright {

/// True when the folder holds the results of a sweep.
bool is_sweep_folder(const std::filesystem::path& folder);

/// Writes `report.html` into the folder of a finished sweep and returns its path. Throws Error if the folder
/// holds no readable results or the page cannot be written.
std::filesystem::path write_sweep_report(const std::filesystem::path& folder);

}  // namespace upright
