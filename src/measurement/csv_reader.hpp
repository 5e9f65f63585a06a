// Tables of numbers as text, from other people's programs: commas, semicolons, tabs or spaces between cells,
// decimal points or commas, a byte order mark, either line end, quotes, a row of units.
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
  bool header = true;             ///< the first row names the columns; else they are numbered from 1
  std::optional<char> delimiter;  ///< found from the first rows otherwise
  std::optional<char> decimal;    ///< '.' or ','; found from the first number that has one otherwise
};

/// A row: one value per wanted column that is there, NaN where its cell is missing, empty or not a finite
/// number such as NaN or NA.
struct CsvRow {
  std::size_t line = 0;
  std::span<const double> values;
};

struct CsvTable {
  std::vector<std::string> names;                 ///< all columns of the file
  std::vector<std::optional<std::size_t>> place;  ///< of each wanted column among a row's values
  std::vector<std::string> units;                 ///< of each wanted column, from a row of units; else empty
};

/// What is found at the top of the file, before its first row of numbers.
using CsvHead = std::function<void(const CsvTable&)>;
using CsvSink = std::function<void(const CsvRow&)>;

/// Reads the wanted columns in one pass (an empty name is none of them); of the file no more than a block is
/// held. A last line that was cut off, as a power cut leaves it, is left out. Throws ConfigError with file
/// and line for text where a number belongs, and for files that are not such a table at all (UTF-16, MATLAB,
/// spreadsheets), which it names.
CsvTable read_csv(const std::filesystem::path& file, const std::vector<std::string>& wanted,
                  const CsvFormat& format, const CsvHead& head, const CsvSink& sink);

}  // namespace upright
