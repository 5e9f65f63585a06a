// Text tables of numbers from other programs: with commas, semicolons, tabs or spaces between cells, decimal
// points or commas, a byte order mark, any line ends, quotes, and a row of units.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace upright {

struct CsvFormat {
  bool header = true;             ///< the first row names the columns; otherwise they are numbered from 1
  std::optional<char> delimiter;  ///< if empty, detected from the first rows
  std::optional<char> decimal;    ///< '.' or ','; if empty, detected from the first number with one
};

/// A row: one value for each wanted column of the file; NaN if its cell is missing, empty, or not finite
/// (such as NaN or NA).
struct CsvRow {
  std::size_t line = 0;
  std::span<const double> values;
};

struct CsvTable {
  std::vector<std::string> names;                 ///< all columns of the file
  std::vector<std::optional<std::size_t>> place;  ///< index of each wanted column in the values of a row
  std::vector<std::string> units;  ///< of each wanted column, from a row of units; otherwise empty
};

/// What is found at the top of the file, before its first row of numbers.
using CsvHead = std::function<void(const CsvTable&)>;
using CsvSink = std::function<void(const CsvRow&)>;

/// Reads the wanted columns in one pass; an empty name means that a column is not wanted. Only one block of
/// the file is in memory. An incomplete last line, as after a power cut, is dropped. Throws ConfigError with
/// file and line for text in place of a number, and for files that are not such a table (UTF-16, MATLAB,
/// spreadsheets), with their format.
CsvTable read_csv(const std::filesystem::path& file, const std::vector<std::string>& wanted,
                  const CsvFormat& format, const CsvHead& head, const CsvSink& sink);

}  // namespace upright
