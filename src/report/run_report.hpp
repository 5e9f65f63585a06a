// The report of one run: whether it stayed up, why it ended, how it moved, and its timing.
#pragma once

#include <filesystem>

#include "upright/base/progress.hpp"

namespace upright {

/// Writes `report.html` into the run directory and returns its path. Accepts a run that was cut short (no
/// outcome, an incomplete last row). Throws Error if the directory is not a run or the page cannot be
/// written.
std::filesystem::path write_run_report(const std::filesystem::path& run_directory,
                                       const ProgressCallback& progress = {});

}  // namespace upright
