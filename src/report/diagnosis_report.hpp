// The report of a diagnosis: how the gap shrinks, what was found, and the residual force before and after.
#pragma once

#include <filesystem>

namespace upright {

/// True when the folder holds the results of a diagnosis.
bool is_diagnosis_folder(const std::filesystem::path& folder);

/// Writes `report.html` into the folder and returns its path. Throws Error when the folder holds no readable
/// results or the page cannot be written.
std::filesystem::path write_diagnosis_report(const std::filesystem::path& folder);

}  // namespace upright
