#include "upright/analysis/measurement.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>

#include "upright/model/error.hpp"
#include "upright/model/yaml_reader.hpp"
#include "upright/runtime/experiment_file.hpp"
#include "upright/runtime/run_reader.hpp"

namespace upright {

namespace {

/// A run that says nothing.
class NothingMoves : public ConfigError {
 public:
  using ConfigError::ConfigError;
};

namespace fs = std::filesystem;

/// Where a quantity comes from in a foreign CSV: a column by name or by number, scaled and shifted.
struct Source {
  std::string column;
  double scale = 1.0;
  double offset = 0.0;
};

struct Mapping {
  fs::path file;
  std::map<std::string, Source> columns;
  bool header = true;
  bool cart_locked = false;
  std::optional<double> cart_resolution_m, theta_resolution_rad;
  std::optional<double> from_s, to_s;
};

struct Table {
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;
  std::vector<std::size_t> lines;
};

std::vector<std::string> split(const std::string& line) {
  const char separator = line.find(',') != std::string::npos    ? ','
                         : line.find(';') != std::string::npos  ? ';'
                         : line.find('\t') != std::string::npos ? '\t'
                                                                : ',';
  std::vector<std::string> cells;
  std::size_t begin = 0;
  while (begin <= line.size()) {
    std::size_t end = line.find(separator, begin);
    if (end == std::string::npos) end = line.size();
    std::size_t first = begin, last = end;
    while (first < last && (line[first] == ' ' || line[first] == '"' || line[first] == '\t')) ++first;
    while (last > first && (line[last - 1] == ' ' || line[last - 1] == '"' || line[last - 1] == '\r' ||
                            line[last - 1] == '\t'))
      --last;
    cells.push_back(line.substr(first, last - first));
    begin = end + 1;
  }
  return cells;
}

std::optional<double> number_in(const std::string& cell) {
  const char* first = cell.data();
  const char* last = first + cell.size();
  if (first != last && *first == '+') ++first;
  double value = 0.0;
  const auto result = std::from_chars(first, last, value);
  if (result.ec != std::errc{} || result.ptr != last) return std::nullopt;
  return value;
}

/// Reads the wanted columns of a CSV. A last line that was cut off, as a power cut leaves it, is left out.
Table read_table(const fs::path& file, const std::vector<std::string>& wanted, bool header) {
  std::ifstream in(file);
  if (!in) throw ConfigError("check the path: cannot read " + file.string());
  Table table;
  std::string line;
  std::size_t number = 0;
  std::vector<std::string> names;
  std::vector<std::size_t> places;
  while (std::getline(in, line)) {
    ++number;
    if (line.empty() || line[0] == '#' || line == "\r") continue;
    const bool cut_off = in.eof();
    const std::vector<std::string> cells = split(line);
    if (names.empty()) {
      if (header) {
        names = cells;
      } else {
        for (std::size_t i = 1; i <= cells.size(); ++i) names.push_back(std::to_string(i));
      }
      for (const std::string& name : wanted) {
        const auto at = std::find(names.begin(), names.end(), name);
        if (at == names.end()) continue;
        places.push_back(static_cast<std::size_t>(at - names.begin()));
        table.names.push_back(name);
      }
      table.columns.resize(places.size());
      if (header) continue;
    }
    std::vector<double> row;
    for (const std::size_t place : places) {
      const auto value = place < cells.size() ? number_in(cells[place]) : std::nullopt;
      if (!value || !std::isfinite(*value)) {
        if (cut_off) break;
        throw ConfigError("remove or repair the row: " + file.string() + ":" + std::to_string(number) + ": " +
                          names[place] + " is " +
                          (place < cells.size() ? "'" + cells[place].substr(0, 40) + "'" : "missing") +
                          ", not a finite number");
      }
      row.push_back(*value);
    }
    if (row.size() != places.size() || (cut_off && cells.size() < names.size())) continue;
    for (std::size_t i = 0; i < row.size(); ++i) table.columns[i].push_back(row[i]);
    table.lines.push_back(number);
  }
  return table;
}

Mapping plain_mapping(const fs::path& file) {
  Mapping mapping;
  mapping.file = file;
  for (const char* name : {"time_s", "voltage_v", "cart_m", "theta_rad"})
    mapping.columns[name] = {name, 1.0, 0.0};
  return mapping;
}

Mapping read_mapping(const fs::path& file) {
  const YamlMap document = YamlMap::from_file(file);
  const YamlMap map = document.map("dataset");
  Mapping mapping;
  mapping.file = map.path("file");
  mapping.header = map.flag_or("header", true);
  mapping.cart_locked = map.flag_or("cart_locked", false);
  mapping.from_s = map.optional_number("from_s");
  mapping.to_s = map.optional_number("to_s");
  const YamlMap columns = map.map("columns");
  for (const char* name : {"time_s", "voltage_v", "cart_m", "theta_rad"}) {
    if (!columns.has(name)) continue;
    if (columns.is_map(name)) {
      const YamlMap source = columns.map(name);
      mapping.columns[name] = {source.text("column"), source.number_or("scale", 1.0),
                               source.number_or("offset", 0.0)};
      source.finish();
    } else {
      mapping.columns[name] = {columns.text(name), 1.0, 0.0};
    }
  }
  columns.finish();
  if (const auto resolution = map.optional_map("resolution")) {
    mapping.cart_resolution_m = resolution->optional_number("cart_m", Range::positive());
    mapping.theta_resolution_rad = resolution->optional_number("theta_rad", Range::positive());
    resolution->finish();
  }
  map.finish();
  document.finish();
  if (!mapping.columns.contains("time_s"))
    map.fail("columns", "names no time_s", "map time_s to the column that holds the time");
  return mapping;
}

void refuse_bad_time(const std::vector<double>& time, const Table& table, const fs::path& file) {
  for (std::size_t k = 1; k < time.size(); ++k)
    if (!(time[k] > time[k - 1]))
      throw ConfigError("sort the rows by time and remove doubled ones: " + file.string() + ":" +
                        std::to_string(table.lines[k]) + ": time_s does not grow (" +
                        exact_text(time[k - 1]) + " then " + exact_text(time[k]) + ")");
}

bool is_constant(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [&](double v) { return v == values.front(); });
}

/// Undoes the wrap of an angle that was folded into one turn: no real pendulum turns half around between two
/// rows.
void unwrap(std::vector<double>& theta) {
  double turns = 0.0;
  for (std::size_t k = 1; k < theta.size(); ++k) {
    const double step = theta[k] + turns - theta[k - 1];
    turns -= 2.0 * std::numbers::pi * std::round(step / (2.0 * std::numbers::pi));
    theta[k] += turns;
  }
}

Measurement load(const Mapping& mapping, const std::string& name) {
  std::vector<std::string> wanted;
  for (const auto& [quantity, source] : mapping.columns) wanted.push_back(source.column);
  const Table table = read_table(mapping.file, wanted, mapping.header);
  const auto column = [&](const std::string& quantity) -> std::vector<double> {
    const auto at = mapping.columns.find(quantity);
    if (at == mapping.columns.end()) return {};
    const auto named = std::find(table.names.begin(), table.names.end(), at->second.column);
    if (named == table.names.end()) return {};
    std::vector<double> values = table.columns[static_cast<std::size_t>(named - table.names.begin())];
    for (double& value : values) value = value * at->second.scale + at->second.offset;
    return values;
  };
  Measurement m;
  m.name = name;
  m.time_s = column("time_s");
  m.voltage_v = column("voltage_v");
  m.cart_m = column("cart_m");
  m.theta_rad = column("theta_rad");
  m.cart_locked = mapping.cart_locked;
  const std::string file = mapping.file.string();
  if (table.names.empty() || std::find(table.names.begin(), table.names.end(),
                                       mapping.columns.at("time_s").column) == table.names.end())
    throw ConfigError(
        "name the columns time_s, voltage_v, cart_m, theta_rad, or map them in a dataset file: " + file +
        ":1: there is no column for time_s");
  if (m.cart_m.empty() && m.theta_rad.empty() && !m.time_s.empty())
    throw ConfigError("give cart_m or theta_rad, by name or by a dataset file: " + file +
                      ":1: neither is there");
  if (m.size() < 10)
    throw ConfigError("record a longer run: " + file + ":1: " + std::to_string(m.size()) +
                      " samples, fewer than 10, say nothing");
  refuse_bad_time(m.time_s, table, mapping.file);
  if (m.voltage_v.empty()) {
    if (!m.cart_locked)
      throw ConfigError("give voltage_v, or set cart_locked: true if the pendulum swings alone: " + file +
                        ":1: there is no column for voltage_v");
    m.voltage_v.assign(m.size(), 0.0);
  }
  unwrap(m.theta_rad);
  if (mapping.from_s || mapping.to_s) {
    const auto first =
        std::lower_bound(m.time_s.begin(), m.time_s.end(), mapping.from_s.value_or(m.time_s.front()));
    const auto last =
        std::upper_bound(m.time_s.begin(), m.time_s.end(), mapping.to_s.value_or(m.time_s.back()));
    const auto a = first - m.time_s.begin(), b = last - m.time_s.begin();
    if (b - a < 10)
      throw ConfigError("widen from_s and to_s: " + file + " has fewer than 10 samples between them");
    for (auto* values : {&m.time_s, &m.voltage_v, &m.cart_m, &m.theta_rad})
      if (!values->empty()) *values = std::vector<double>(values->begin() + a, values->begin() + b);
  }
  const bool still =
      (m.cart_m.empty() || is_constant(m.cart_m)) && (m.theta_rad.empty() || is_constant(m.theta_rad));
  if (still) throw NothingMoves("record a run in which something moves: " + file + " holds constant data");
  m.cart_resolution_m = mapping.cart_resolution_m.value_or(find_resolution(m.cart_m));
  m.theta_resolution_rad = mapping.theta_resolution_rad.value_or(find_resolution(m.theta_rad));
  if (m.cart_resolution_m > 0.0) m.cart_weight = dwell_weights(m.cart_m);
  if (m.theta_resolution_rad > 0.0) m.theta_weight = dwell_weights(m.theta_rad);
  const bool motor_off = is_constant(m.voltage_v) && m.voltage_v.front() == 0.0;
  if (m.cart_m.empty() && motor_off && !m.cart_locked) {
    m.cart_locked = true;
    m.notes.push_back(name + ": no cart position and no voltage, so the cart is taken as held");
  }
  if (m.has_cart() && m.cart_locked) m.cart_m.clear();
  return m;
}

/// A run directory's mapping. Of an experiment's run, what somebody's hands did is left out: before the
/// pendulum was let go no equation of motion holds.
Mapping mapping_of_run(const fs::path& directory) {
  Mapping mapping = plain_mapping(directory / "samples.csv");
  std::error_code problem;
  if (!fs::exists(directory / "run.yaml", problem)) return mapping;
  const YamlMap document = YamlMap::from_file(directory / "run.yaml");
  if (!document.has("experiment")) return mapping;
  const PieceKind kind = read_piece(document.map("experiment").map("piece")).kind;
  if (kind != PieceKind::free_decay && kind != PieceKind::closed_loop && kind != PieceKind::delay_sweep)
    return mapping;
  const std::vector<LogRecord> rows = read_samples(mapping.file).rows;
  std::size_t from = 0;
  if (kind == PieceKind::free_decay) {
    mapping.cart_locked = true;
    // Held still: the last row before the angle has left where it was held.
    constexpr double left_rad = 0.02;
    while (from + 1 < rows.size() && std::abs(rows[from + 1].theta_rad - rows[0].theta_rad) < left_rad)
      ++from;
  } else {
    while (from + 1 < rows.size() && (rows[from].flags & row_flag::feedback) == 0) ++from;
    // Its first voltage is what lets the hand go.
    from = std::min(from + 2, rows.empty() ? 0 : rows.size() - 1);
  }
  if (from > 0) mapping.from_s = static_cast<double>(rows[from].time_ns) / 1e9;
  return mapping;
}

}  // namespace

double find_resolution(const std::vector<double>& values) {
  if (values.size() < 2) return 0.0;
  std::vector<double> steps;
  for (std::size_t k = 1; k < values.size(); ++k) {
    const double step = std::abs(values[k] - values[k - 1]);
    if (step > 0.0) steps.push_back(step);
  }
  if (steps.empty()) return 0.0;
  std::sort(steps.begin(), steps.end());
  const double range =
      *std::max_element(values.begin(), values.end()) - *std::min_element(values.begin(), values.end());
  // Values printed in decimals differ in their last digit; steps below a millionth of the range are that.
  const auto real = std::lower_bound(steps.begin(), steps.end(), 1e-7 * range);
  if (real == steps.end()) return 0.0;
  double quantum = *real;
  for (int pass = 0; pass < 3; ++pass) {
    double sum = 0.0, count = 0.0, off = 0.0;
    const double largest = 20.0 * quantum;
    for (auto at = real; at != steps.end() && *at <= largest; ++at) {
      const double multiple = std::round(*at / quantum);
      sum += *at * multiple;
      count += multiple * multiple;
      if (std::abs(*at / quantum - multiple) > 0.2) off += 1.0;
    }
    const auto examined = static_cast<double>(std::upper_bound(real, steps.end(), largest) - real);
    if (off > 0.05 * examined) return 0.0;
    quantum = sum / count;
  }
  return quantum;
}

std::vector<double> dwell_weights(const std::vector<double>& values) {
  struct Dwell {
    std::size_t first, length;
  };
  std::vector<Dwell> dwells;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (dwells.empty() || values[k] != values[k - 1]) dwells.push_back({k, 0});
    ++dwells.back().length;
  }
  std::vector<double> weights(values.size(), 1.0);
  for (std::size_t d = 0; d < dwells.size(); ++d) {
    const bool last = d + 1 == dwells.size();
    const auto length = static_cast<double>(dwells[d].length);
    const double before = d > 0 ? static_cast<double>(dwells[d - 1].length) : length;
    const double after = last ? length : static_cast<double>(dwells[d + 1].length);
    const bool turns = d > 0 && !last && values[dwells[d - 1].first] == values[dwells[d + 1].first];
    const double new_ones = turns ? 1.0 : std::min({length, before, after});
    const auto from = weights.begin() + static_cast<std::ptrdiff_t>(dwells[d].first);
    std::fill(from, from + static_cast<std::ptrdiff_t>(dwells[d].length), new_ones / length);
  }
  return weights;
}

double find_noise(const std::vector<double>& values) {
  if (values.size() < 20) return 0.0;
  std::vector<double> fourth;
  for (std::size_t k = 4; k < values.size(); ++k)
    fourth.push_back(std::abs(values[k] - 4.0 * values[k - 1] + 6.0 * values[k - 2] - 4.0 * values[k - 3] +
                              values[k - 4]));
  const auto middle = fourth.begin() + static_cast<std::ptrdiff_t>(fourth.size() / 2);
  std::nth_element(fourth.begin(), middle, fourth.end());
  constexpr double median_to_sigma = 1.0 / 0.6745;
  return *middle * median_to_sigma / std::sqrt(70.0);  // the squares of 1 4 6 4 1 add up to 70
}

double Measurement::median_period_s() const {
  std::vector<double> steps;
  for (std::size_t k = 1; k < time_s.size(); ++k) steps.push_back(time_s[k] - time_s[k - 1]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

double Measurement::cart_noise_m() const {
  const double step = cart_resolution_m / std::sqrt(12.0);
  return std::max({step, cart_resolution_m > 0.0 ? 0.0 : find_noise(cart_m), 1e-9});
}

double Measurement::theta_noise_rad() const {
  const double step = theta_resolution_rad / std::sqrt(12.0);
  return std::max({step, theta_resolution_rad > 0.0 ? 0.0 : find_noise(theta_rad), 1e-9});
}

Measurement read_measurement(const fs::path& path) {
  std::error_code problem;
  if (fs::is_directory(path, problem)) {
    const fs::path samples = path / "samples.csv";
    if (!fs::exists(samples, problem))
      throw ConfigError("name a run directory, a CSV or a dataset file: " + path.string() +
                        " has no samples.csv");
    return load(mapping_of_run(path),
                path.filename().empty() ? path.parent_path().filename().string() : path.filename().string());
  }
  const std::string extension = path.extension().string();
  if (extension == ".yaml" || extension == ".yml") return load(read_mapping(path), path.stem().string());
  return load(plain_mapping(path), path.stem().string());
}

std::vector<Measurement> read_measurements(const std::vector<fs::path>& paths) {
  std::vector<Measurement> runs;
  std::vector<std::string> notes;
  std::optional<NothingMoves> still;
  for (const fs::path& path : paths) {
    try {
      runs.push_back(read_measurement(path));
    } catch (const NothingMoves& problem) {
      notes.push_back(path.string() +
                      " is left out: nothing moves in it; see that the cart did not stick and " +
                      "that the encoders are connected");
      still = problem;
    }
  }
  if (runs.empty() && still) throw NothingMoves(*still);
  if (!runs.empty()) runs.front().notes.insert(runs.front().notes.end(), notes.begin(), notes.end());
  return runs;
}

}  // namespace upright
