// Dataset files: how a foreign CSV is read as a measurement. docs/reference/dataset-files.md explains every
// key.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>

#include "csv_reader.hpp"

namespace upright {

class YamlMap;

/// What a measurement is made of, by the names that a CSV without a dataset file has.
inline constexpr std::array<std::string_view, 4> measured_quantities = {"time_s", "voltage_v", "cart_m",
                                                                        "theta_rad"};

/// Where a quantity comes from: a column by name or by number; value = scale x cell + offset.
struct DatasetColumn {
  std::string column;
  double scale = 1.0;
  double offset = 0.0;
  bool scaled = false;    ///< the file gives a scale, so the unit has been thought of
  double delay_s = 0.0;   ///< how much later than measured, or commanded, a cell was written; not of time_s
  double period_s = 0.0;  ///< of time_s: the rows follow each other so, whatever the stamps; 0: as stamped
  double folded_every_rad = 2.0 * std::numbers::pi;  ///< of theta_rad: it was taken modulo this
  bool mirrored = false;  ///< of theta_rad: it was mirrored at the ends of its range, as an absolute value is
};

/// What becomes of a row in which a cell holds no number.
enum class MissingCells {
  gap,   ///< it is left out, and nothing is followed across it
  skip,  ///< it is left out as if it had not been recorded: the row before holds on
  stop,  ///< the file is refused
};

struct Dataset {
  std::filesystem::path file;
  std::map<std::string, DatasetColumn, std::less<>> columns;
  CsvFormat format;
  MissingCells missing = MissingCells::gap;
  bool cart_locked = false;
  std::optional<double> cart_resolution_m, theta_resolution_rad;
  std::optional<double> from_s, to_s;
};

/// Throws ConfigError with file, line and key.
Dataset read_dataset_file(const std::filesystem::path& file);
Dataset read_dataset(const YamlMap& document);

/// A CSV whose columns have the names of the quantities.
Dataset plain_dataset(const std::filesystem::path& csv);

/// The line of a dataset file that says this, as in `cart_m: {column: x, scale: 0.001}`.
std::string column_line(std::string_view quantity, const DatasetColumn& column);

/// Factor from a unit's name to the unit of the quantity ("deg" of theta_rad: pi / 180); nothing where the
/// name is not known.
std::optional<double> factor_of_unit(std::string_view quantity, std::string_view unit);

}  // namespace upright
