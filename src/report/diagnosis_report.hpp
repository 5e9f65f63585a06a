// The report of a diagnosis: the gap after each effect, the effects found, and the residual force before and
// after.
#pragma once

#include <filesystem>

namespace upright {

/// True when the folder holds the results of a diagnosis.
bool is_diagnosis_folder(const std::filesystem::path& folder);

/// Writes `report.html` into the folder and returns its path. Throws Error if the folder has no readable
/// results or the page cannot be written.
std::filesystem::path write_diagnosis_report(const std::filesystem::path& folder);

}  // namespace upright
