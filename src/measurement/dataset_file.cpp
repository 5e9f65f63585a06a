#include "dataset_file.hpp"

#include <algorithm>
#include <cctype>
#include <numbers>
#include <vector>

#include "base/angle_units.hpp"
#include "base/yaml_keys.hpp"
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

/// What a unit may be written with besides its letters.
constexpr std::string_view unit_decoration = "[]() \t\"";

/// A regular expression for the spellings of these names that `plain_unit` takes for one of them.
std::string unit_pattern(const std::vector<std::string_view>& names) {
  const std::string any_decoration = "[\\[\\]() \\t\"]*";
  std::string pattern;
  for (const std::string_view name : names) {
    pattern += (pattern.empty() ? "^" : "|^") + any_decoration;
    for (const char c : name) {
      const char upper = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
      pattern += upper == c ? std::string(1, c) : std::string{'[', c, upper, ']'};
      if ((static_cast<unsigned char>(c) & 0x80) == 0) pattern += any_decoration;
    }
    pattern += any_decoration + "$";
  }
  return pattern;
}

std::vector<std::string_view> unit_names_of(std::string_view quantity) {
  std::vector<std::string_view> names;
  for (const Unit& known : units)
    if (known.quantity == quantity) names.push_back(known.name);
  return names;
}

bool has_counts(std::string_view quantity) {
  return quantity == "cart_m" || quantity == "theta_rad";
}

/// SI units per encoder step, by the keys that rig files have for it.
double factor_of_counts(YamlKeys& keys, const std::string& name) {
  double value = 0.0;
  if (name == "cart_m") {
    keys.number("m_per_count", value, Range::positive());
    return value;
  }
  keys.number("counts_per_revolution", value, Range::positive());
  return 2.0 * std::numbers::pi / value;
}

/// The factor that `unit` stands for. Empty where there is no such key.
std::optional<double> unit_key(YamlKeys& keys, const std::string& name) {
  if (!keys.decides_by_presence("unit", false)) return std::nullopt;
  keys.needs("unit", !keys.decides_by_presence("scale", false), "stands beside scale, which says the same",
             "remove one of them");
  std::string unit;
  keys.text("unit", unit);
  const std::vector<std::string_view> counts(count_words.begin(), count_words.end());
  std::vector<std::string_view> names = unit_names_of(name);
  if (has_counts(name)) names.insert(names.end(), counts.begin(), counts.end());
  Admitted form;
  form.pattern = unit_pattern(names);
  const std::optional<double> factor = factor_of_unit(name, unit);
  const bool counted = is_counts(unit);
  keys.check_form("unit", !counted || has_counts(name), form,
                  "is counts, but " + name + " is not measured by an encoder",
                  "use one of " + unit_names(name));
  if (has_counts(name) && keys.decides_by_pattern("unit", unit_pattern(counts), counted))
    return factor_of_counts(keys, name);
  keys.check("unit", factor.has_value(), "'" + unit + "' is not known",
             "use one of " + unit_names(name) + ", or scale");
  return factor;
}

void column_map_keys(YamlKeys& keys, const std::string& name, DatasetColumn& column) {
  const std::optional<double> unit = unit_key(keys, name);
  keys.text("column", column.column);
  column.scaled = unit || keys.decides_by_presence("scale", false);
  keys.number("scale", column.scale, Range::any(), 1.0);
  column.scale = unit.value_or(column.scale);
  keys.number("offset", column.offset, Range::any(), 0.0);
  if (name == "time_s") {
    std::optional<double> period_s;
    keys.optional_number("period_s", period_s, Range::positive());
    column.period_s = period_s.value_or(0.0);
  } else {
    keys.number("delay_s", column.delay_s, Range::not_negative(), 0.0);
  }
  if (name == "theta_rad") {
    keys.flag("mirrored", column.mirrored);
    keys.number("folded_every_rad", column.folded_every_rad, Range::positive(),
                DatasetColumn{}.folded_every_rad);
  }
  keys.check_not_zero("scale", column.scale, "is 0, which makes the column zero",
                      "give the factor from the column's unit to SI");
}

void column_keys(YamlKeys& columns, const std::string& name, DatasetColumn& column) {
  if (columns.is_map(name.c_str(), false))
    columns.map(name.c_str(), [&](YamlKeys& keys) { column_map_keys(keys, name, column); });
  else
    columns.text(name.c_str(), column.column);
}

void columns_keys(YamlKeys& columns, Dataset& dataset) {
  for (const std::string_view quantity : measured_quantities) {
    const std::string name(quantity);
    if (columns.given(name.c_str(), false)) column_keys(columns, name, dataset.columns[name]);
  }
  columns.require_any({"time_s"});
}

void format_keys(YamlKeys& keys, CsvFormat& format) {
  constexpr Words<4> delimiters = {"comma", "semicolon", "tab", "space"};
  constexpr Words<2> decimals = {"point", "comma"};
  keys.flag("header", format.header, true);
  if (keys.decides_by_presence("delimiter", false)) {
    std::size_t sign = 0;
    keys.one_of("delimiter", sign, delimiters);
    format.delimiter = std::string_view(",;\t ")[sign];
  } else {
    format.delimiter.reset();
  }
  if (keys.decides_by_presence("decimal", false)) {
    bool is_comma = false;
    keys.one_of("decimal", is_comma, decimals);
    format.decimal = is_comma ? ',' : '.';
    keys.needs("decimal", !is_comma || format.delimiter != ',', "is a comma, as is the delimiter",
               "export the file with semicolons");
  }
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

void dataset_keys(YamlKeys& document, Dataset& dataset) {
  constexpr Words<3> missing = {"gap", "skip", "stop"};
  document.map("dataset", [&](YamlKeys& keys) {
    keys.path("file", dataset.file);
    format_keys(keys, dataset.format);
    keys.one_of("missing", dataset.missing, missing, MissingCells::gap);
    keys.flag("cart_locked", dataset.cart_locked);
    keys.optional_number("from_s", dataset.from_s, Range::any());
    keys.optional_number("to_s", dataset.to_s, Range::any());
    keys.map("columns", [&](YamlKeys& columns) { columns_keys(columns, dataset); });
    keys.usual_map("resolution", [&](YamlKeys& resolution) {
      resolution.optional_number("cart_m", dataset.cart_resolution_m, Range::positive());
      resolution.optional_number("theta_rad", dataset.theta_resolution_rad, Range::positive());
    });
    if (keys.given("labels", false)) keys.texts("labels", dataset.labels);
    if (const YamlMap* map = keys.source()) map->finish();
    keys.check("columns", dataset.columns.contains("time_s"), "does not contain time_s",
               "map time_s to the column with the time");
  });
}

Dataset read_dataset(const YamlMap& document) {
  Dataset dataset;
  YamlKeyReader reader(document);
  dataset_keys(reader, dataset);
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
    if (unit_decoration.find(c) == std::string_view::npos)
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
