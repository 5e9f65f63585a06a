#include "dataset_file.hpp"

#include <algorithm>
#include <cctype>
#include <numbers>
#include <vector>

#include "base/angle_units.hpp"
#include "upright/base/yaml_reader.hpp"

namespace upright {

namespace {

namespace fs = std::filesystem;

struct Unit {
  std::string_view quantity, name;
  double factor;
};

constexpr std::array units = {
    Unit{"time_s", "s", 1.0},
    Unit{"time_s", "sec", 1.0},
    Unit{"time_s", "seconds", 1.0},
    Unit{"time_s", "ms", 1e-3},
    Unit{"time_s", "msec", 1e-3},
    Unit{"time_s", "us", 1e-6},
    Unit{"time_s", "\xc2\xb5s", 1e-6},  // micro sign
    Unit{"time_s", "\xce\xbcs", 1e-6},  // Greek mu
    Unit{"time_s", "ns", 1e-9},
    Unit{"time_s", "min", 60.0},
    Unit{"voltage_v", "v", 1.0},
    Unit{"voltage_v", "volt", 1.0},
    Unit{"voltage_v", "mv", 1e-3},
    Unit{"cart_m", "m", 1.0},
    Unit{"cart_m", "dm", 0.1},
    Unit{"cart_m", "cm", 1e-2},
    Unit{"cart_m", "mm", 1e-3},
    Unit{"cart_m", "um", 1e-6},
    Unit{"cart_m", "in", 0.0254},
    Unit{"theta_rad", "rad", 1.0},
    Unit{"theta_rad", "mrad", 1e-3},
    Unit{"theta_rad", "deg", radians_per_degree},
    Unit{"theta_rad", "degree", radians_per_degree},
    Unit{"theta_rad", "degrees", radians_per_degree},
    Unit{"theta_rad", "\xc2\xb0", radians_per_degree},
    Unit{"theta_rad", "rev", 2.0 * std::numbers::pi},
    Unit{"theta_rad", "turn", 2.0 * std::numbers::pi},
};

/// The words for numbers of an encoder's steps.
constexpr std::array<std::string_view, 5> count_words = {"counts", "count", "cnt", "ticks", "steps"};

std::string unit_names(std::string_view quantity) {
  std::string names;
  for (const Unit& known : units)
    if (known.quantity == quantity) names += std::string(names.empty() ? "" : ", ") + std::string(known.name);
  if (quantity == "cart_m" || quantity == "theta_rad") names += ", counts";
  return names;
}

/// SI units per encoder step, by the keys that rig files have for it.
double factor_of_counts(const YamlMap& source, const std::string& name) {
  if (name == "cart_m") return source.number("m_per_count", Range::positive());
  if (name == "theta_rad")
    return 2.0 * std::numbers::pi / source.number("counts_per_revolution", Range::positive());
  source.fail("unit", "is counts, but " + name + " is not measured by an encoder",
              "use one of " + unit_names(name));
}

/// The factor that `unit` stands for. Empty where there is no such key.
std::optional<double> read_unit(const YamlMap& source, const std::string& name) {
  if (!source.has("unit")) return std::nullopt;
  if (source.has("scale"))
    source.fail("unit", "stands beside scale, which says the same", "remove one of them");
  const std::string unit = source.text("unit");
  if (is_counts(unit)) return factor_of_counts(source, name);
  const auto factor = factor_of_unit(name, unit);
  if (!factor)
    source.fail("unit", "'" + unit + "' is not known", "use one of " + unit_names(name) + ", or scale");
  return factor;
}

DatasetColumn read_column(const YamlMap& columns, const std::string& name) {
  if (!columns.is_map(name)) return {columns.text(name), 1.0, 0.0, false};
  const YamlMap source = columns.map(name);
  const std::optional<double> unit = read_unit(source, name);
  DatasetColumn column{source.text("column"), unit.value_or(source.number_or("scale", 1.0)),
                       source.number_or("offset", 0.0), unit || source.has("scale")};
  if (name != "time_s") column.delay_s = source.number_or("delay_s", 0.0, Range::not_negative());
  if (name == "time_s") column.period_s = source.optional_number("period_s", Range::positive()).value_or(0.0);
  if (name == "theta_rad") column.mirrored = source.flag_or("mirrored", false);
  if (name == "theta_rad")
    column.folded_every_rad =
        source.optional_number("folded_every_rad", Range::positive()).value_or(column.folded_every_rad);
  if (column.scale == 0.0)
    source.fail("scale", "is 0, which makes the column zero", "give the factor from the column's unit to SI");
  source.finish();
  return column;
}

std::optional<char> read_delimiter(const YamlMap& map) {
  if (!map.has("delimiter")) return std::nullopt;
  const std::vector<std::string> names = {"comma", "semicolon", "tab", "space"};
  constexpr std::string_view signs = ",;\t ";
  const std::string name = map.choice("delimiter", names);
  return signs[static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin())];
}

std::optional<char> read_decimal(const YamlMap& map) {
  if (!map.has("decimal")) return std::nullopt;
  return map.choice("decimal", {"point", "comma"}) == "comma" ? ',' : '.';
}

MissingCells read_missing(const YamlMap& map) {
  if (!map.has("missing")) return MissingCells::gap;
  const std::string name = map.choice("missing", {"gap", "skip", "stop"});
  return name == "gap" ? MissingCells::gap : name == "skip" ? MissingCells::skip : MissingCells::stop;
}

/// A column's name as YAML reads it back.
std::string as_yaml(const std::string& name) {
  const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
  });
  if (plain) return name;
  std::string text = "\"";
  for (const char c : name) text += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return text + "\"";
}

}  // namespace

Dataset plain_dataset(const fs::path& csv) {
  Dataset dataset;
  dataset.file = csv;
  for (const std::string_view name : measured_quantities)
    dataset.columns[std::string(name)] = {std::string(name), 1.0, 0.0, false};
  return dataset;
}

Dataset read_dataset_file(const fs::path& file) {
  const YamlMap document = YamlMap::from_file(file);
  const Dataset dataset = read_dataset(document);
  document.finish();
  return dataset;
}

Dataset read_dataset(const YamlMap& document) {
  const YamlMap map = document.map("dataset");
  Dataset dataset;
  dataset.file = map.path("file");
  dataset.format.header = map.flag_or("header", true);
  dataset.format.delimiter = read_delimiter(map);
  dataset.format.decimal = read_decimal(map);
  if (dataset.format.delimiter == ',' && dataset.format.decimal == ',')
    map.fail("decimal", "is a comma, as is the delimiter", "export the file with semicolons");
  dataset.missing = read_missing(map);
  dataset.cart_locked = map.flag_or("cart_locked", false);
  dataset.from_s = map.optional_number("from_s");
  dataset.to_s = map.optional_number("to_s");
  const YamlMap columns = map.map("columns");
  for (const std::string_view quantity : measured_quantities) {
    const std::string name(quantity);
    if (columns.has(name)) dataset.columns[name] = read_column(columns, name);
  }
  columns.finish();
  if (const auto resolution = map.optional_map("resolution")) {
    dataset.cart_resolution_m = resolution->optional_number("cart_m", Range::positive());
    dataset.theta_resolution_rad = resolution->optional_number("theta_rad", Range::positive());
    resolution->finish();
  }
  map.finish();
  if (!dataset.columns.contains("time_s"))
    map.fail("columns", "does not contain time_s", "map time_s to the column with the time");
  return dataset;
}

std::string column_line(std::string_view quantity, const DatasetColumn& column) {
  std::string text = std::string(quantity) + ": {column: " + as_yaml(column.column);
  if (column.scale != 1.0) text += ", scale: " + exact_text(column.scale);
  if (column.offset != 0.0) text += ", offset: " + exact_text(column.offset);
  if (column.delay_s != 0.0) text += ", delay_s: " + exact_text(column.delay_s);
  if (column.period_s != 0.0) text += ", period_s: " + exact_text(column.period_s);
  if (column.folded_every_rad != DatasetColumn{}.folded_every_rad)
    text += ", folded_every_rad: " + exact_text(column.folded_every_rad);
  if (column.mirrored) text += ", mirrored: true";
  return text + "}";
}

namespace {

/// Without brackets, blanks and capitals.
std::string plain_unit(std::string_view unit) {
  std::string name;
  for (const char c : unit)
    if (std::string_view("[]() \t\"").find(c) == std::string_view::npos)
      name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name;
}

}  // namespace

std::optional<double> factor_of_unit(std::string_view quantity, std::string_view unit) {
  const std::string name = plain_unit(unit);
  for (const Unit& known : units)
    if (known.quantity == quantity && known.name == name) return known.factor;
  return std::nullopt;
}

bool is_counts(std::string_view unit) {
  const std::string name = plain_unit(unit);
  return std::find(count_words.begin(), count_words.end(), name) != count_words.end();
}

std::string_view unit_in_name(std::string_view column) {
  for (const std::string_view brackets : {"[]", "()"}) {
    const std::size_t begin = column.rfind(brackets[0]);
    if (begin != std::string_view::npos && begin > 0 && column.back() == brackets[1])
      return column.substr(begin + 1, column.size() - begin - 2);
  }
  return {};
}

}  // namespace upright
