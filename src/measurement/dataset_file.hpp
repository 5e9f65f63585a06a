// Dataset files: how a foreign CSV or MATLAB file is read as a measurement. docs/reference/dataset-files.md
// explains every key.
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

class YamlKeys;
class YamlMap;

/// The quantities of a measurement, with their column names in a CSV file without a dataset file.
inline constexpr std::array<std::string_view, 4> measured_quantities = {"time_s", "voltage_v", "cart_m",
                                                                        "theta_rad"};

/// The source of a quantity: a column by name or number; value = scale x cell + offset.
struct DatasetColumn {
  std::string column;
  double scale = 1.0;
  double offset = 0.0;
  bool scaled = false;    ///< the file gives a scale or a unit
  double delay_s = 0.0;   ///< delay of recording after measurement or command; not for time_s
  double period_s = 0.0;  ///< for time_s: the true period of the rows; 0: as stamped
  double folded_every_rad = 2.0 * std::numbers::pi;  ///< for theta_rad: it was taken modulo this
  bool mirrored = false;  ///< for theta_rad: it was mirrored at the ends of its range, like an absolute value
};

/// The treatment of a row with a cell that is not a number.
enum class MissingCells {
  gap,   ///< it is dropped and leaves a gap in the record
  skip,  ///< it is dropped without a gap: the previous row stays valid
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
  /// What distinguishes this run from others of the rig: a name and a text or number for each.
  std::map<std::string, std::string> labels;
};

/// Throws ConfigError with file, line and key.
Dataset read_dataset_file(const std::filesystem::path& file);
Dataset read_dataset(const YamlMap& document);
/// Visits the keys of the whole file, for the reader and the schema.
void dataset_keys(YamlKeys& document, Dataset& dataset);

/// A CSV whose columns have the names of the quantities.
Dataset plain_dataset(const std::filesystem::path& csv);

/// The line of a dataset file that says this, as in `cart_m: {column: x, scale: 0.001}`.
std::string column_line(std::string_view quantity, const DatasetColumn& column);

/// Factor from a named unit to the unit of the quantity ("deg" for theta_rad: pi / 180). Empty if the name is
/// unknown.
std::optional<double> factor_of_unit(std::string_view quantity, std::string_view unit);

/// Whether a unit is the step of an encoder, whose size only the rig's builder knows.
bool is_counts(std::string_view unit);

/// The unit in the name of a column, as in `angle [deg]` or `angle (deg)`; otherwise empty.
std::string_view unit_in_name(std::string_view column);

}  // namespace upright
