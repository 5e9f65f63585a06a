// A MATLAB file as a table, read as a CSV file is.
#pragma once

#include "csv_reader.hpp"

namespace upright {

/// The wanted vectors as columns; `line` of a row is its number from 1. Throws ConfigError where they differ
/// in length, and for what MatFile refuses.
void read_mat(const std::filesystem::path& file, const std::vector<std::string>& wanted, const CsvHead& head,
              const CsvSink& sink);

}  // namespace upright
