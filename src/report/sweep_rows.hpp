// The rows of the CSV files that a sweep writes.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace upright {

using SweepRow = std::vector<std::string>;

/// The rows after the header. Throws ConfigError when the file does not begin with `header`, or a row has
/// another number of cells.
std::vector<SweepRow> read_sweep_rows(const std::filesystem::path& file, const std::string& header);

}  // namespace upright
