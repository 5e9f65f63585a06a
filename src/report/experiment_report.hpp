// The page of an experiment: its runs, and for a delay sweep the paper's Section 3 on one page, the rig's
// outcomes over a simulated sweep of the same loop, with the linear critical delay.
#pragma once

#include <filesystem>

namespace upright {

bool is_experiment_folder(const std::filesystem::path& folder);
/// Writes FOLDER/report.html and returns its path. Throws Error.
std::filesystem::path write_experiment_report(const std::filesystem::path& folder);

}  // namespace upright
