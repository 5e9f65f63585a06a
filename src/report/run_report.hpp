// The report of one run: did it stay up, why did it end, how did it move, and how well was time kept.
#pragma once

#include <filesystem>

#include "upright/base/progress.hpp"

namespace upright {

/// Writes `report.html` into the run directory and returns its path. Works on a run that was cut short (no
/// outcome, a torn last row). Throws Error when the directory is not a run or the page cannot be written.
std::filesystem::path write_run_report(const std::filesystem::path& run_directory,
                                       const ProgressCallback& progress = {});

}  // namespace upright
