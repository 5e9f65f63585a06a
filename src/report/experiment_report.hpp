// The page of an experiment: its runs. For a delay sweep also the comparison of the paper's Section 3: the
// outcomes on the rig, a simulated sweep of the same loop and the critical delay of the linear analysis.
#pragma once

#include <filesystem>

namespace upright {

bool is_experiment_folder(const std::filesystem::path& folder);
/// Writes FOLDER/report.html and returns its path. Throws Error.
std::filesystem::path write_experiment_report(const std::filesystem::path& folder);

}  // namespace upright
