// A row of the log as one line of JSON.
#pragma once

#include <cstddef>

#include "upright/record/log_record.hpp"

namespace upright {

/// Largest length of a row as JSON.
inline constexpr std::size_t longest_row_json = 1024;

/// Writes the row as an object with the names of samples.csv, and `timestamp`, which PlotJuggler takes for
/// the time; numbers read back to the same bits, and those that are not finite are left out. Returns the
/// length (at most `longest_row_json`). Allocates nothing.
std::size_t format_row_json(const LogRecord& row, char* out) noexcept;

}  // namespace upright
