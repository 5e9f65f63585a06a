#include "upright/measurement/measurement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "base/median.hpp"
#include "column_delay.hpp"
#include "dataset_file.hpp"
#include "experiment/experiment_file.hpp"
#include "experiment/pieces/free_decay.hpp"
#include "folded_angle.hpp"
#include "mat_file.hpp"
#include "mat_table.hpp"
#include "upright/base/error.hpp"
#include "upright/base/yaml_reader.hpp"
#include "upright/record/run_reader.hpp"

namespace upright {

namespace {

/// A run that says nothing.
class NothingMoves : public ConfigError {
 public:
  using ConfigError::ConfigError;
};

namespace fs = std::filesystem;

bool is_constant(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [&](double v) { return v == values.front(); });
}

/// Collects a table's rows into a measurement, as they are read.
class Collector {
 public:
  /// Columns of `dataset` without a scale get that of the unit which the file itself names.
  Collector(Dataset& dataset, Measurement& measurement) : dataset_(dataset), m_(measurement) {
    for (const std::string_view quantity : measured_quantities) {
      const auto at = dataset.columns.find(quantity);
      sources_.push_back(at == dataset.columns.end() ? nullptr : &at->second);
      wanted_.push_back(sources_.back() ? sources_.back()->column : "");
    }
  }

  void read() {
    const auto head = [this](const CsvTable& table) { begin(table); };
    const auto sink = [this](const CsvRow& row) { take(row); };
    if (is_mat_file(dataset_.file)) {
      row_word_ = "row";
      read_mat(dataset_.file, wanted_, head, sink);
    } else {
      read_csv(dataset_.file, wanted_, dataset_.format, head, sink);
    }
    refuse_missing_rows();
    m_.missing_rows = missing_rows_;
    if (missing_rows_ == 0) return;
    m_.notes.push_back(m_.name + ": " + std::to_string(missing_rows_) + " of " +
                       std::to_string(missing_rows_ + m_.size()) +
                       " rows have a cell without a number, the first in " + row_word_ + " " +
                       std::to_string(first_missing_line_) + "; they are " +
                       (dataset_.missing == MissingCells::skip ? "skipped" : "gaps in the record"));
  }

 private:
  enum { time, voltage, cart, theta };

  void begin(const CsvTable& table) {
    place_ = table.place;
    const std::string at = dataset_.file.string() + ":1: ";
    const auto has = [&](int quantity) { return place_[static_cast<std::size_t>(quantity)].has_value(); };
    if (!has(time)) throw ConfigError(at + "there is no column for time_s" + columns_of(table) + map_them);
    for (std::size_t q = 0; q < sources_.size(); ++q)
      if (!place_[q] && sources_[q] && sources_[q]->column != measured_quantities[q])
        throw ConfigError(at + "there is no column '" + sources_[q]->column + "'" + columns_of(table) +
                          ": correct its name in the dataset file");
    if (!has(cart) && !has(theta))
      throw ConfigError(at + "there is no column for cart_m or theta_rad" + columns_of(table) + map_them);
    if (!has(voltage) && !dataset_.cart_locked)
      throw ConfigError(at + "there is no column for voltage_v" + columns_of(table) +
                        ": map it in a dataset file, or set cart_locked: true there if the pendulum swings "
                        "alone (docs/reference/dataset-files.md)");
    apply_units(table);
  }

  static constexpr const char* map_them =
      ": name the columns time_s, voltage_v, cart_m, theta_rad, or map them in a dataset file "
      "(docs/reference/dataset-files.md)";

  static std::string columns_of(const CsvTable& table) {
    constexpr std::size_t max_named = 20;
    if (table.names.empty()) return " (the file is empty)";
    std::string text;
    for (std::size_t i = 0; i < std::min(max_named, table.names.size()); ++i)
      text += (i > 0 ? ", " : " (the columns are: ") + table.names[i].substr(0, 40);
    return text + (table.names.size() > max_named ? ", ...)" : ")");
  }

  /// A unit in the file is taken at its word where the dataset file says nothing of a scale.
  void apply_units(const CsvTable& table) {
    for (std::size_t q = 0; q < sources_.size(); ++q) {
      if (!place_[q] || sources_[q]->scaled) continue;
      DatasetColumn& source = *sources_[q];
      const std::string unit(table.units[q].empty() ? unit_in_name(source.column) : table.units[q]);
      if (is_counts(unit)) refuse_counts(source, measured_quantities[q]);
      const auto factor = factor_of_unit(measured_quantities[q], unit);
      if (!factor || *factor == 1.0) continue;
      source.scale = *factor;
      source.scaled = true;
      m_.notes.push_back(m_.name + ": " + source.column + " is in " + unit +
                         " by the file's own header, so " + std::string(measured_quantities[q]) + " = " +
                         exact_text(*factor) + " x cell");
    }
  }

  [[noreturn]] void refuse_counts(const DatasetColumn& source, std::string_view quantity) const {
    throw ConfigError(dataset_.file.string() + ":1: the header says that " + source.column +
                      " is in counts: say in the dataset file how large they are: " + std::string(quantity) +
                      (quantity == "theta_rad" ? ": {column: NAME, unit: counts, counts_per_revolution: N}"
                                               : ": {column: NAME, unit: counts, m_per_count: SIZE}"));
  }

  void take(const CsvRow& row) {
    std::array<double, 4> values{};
    bool whole = true;
    for (std::size_t q = 0; q < values.size(); ++q) {
      if (!place_[q]) continue;
      values[q] = row.values[*place_[q]] * sources_[q]->scale + sources_[q]->offset;
      whole = whole && std::isfinite(values[q]);
    }
    count_time(values[time]);
    const bool timed = std::isfinite(values[time]);
    if (timed && (values[time] < dataset_.from_s.value_or(values[time]) ||
                  values[time] > dataset_.to_s.value_or(values[time]))) {
      unfold(values);
      return;
    }
    if (!whole) return leave_out(row.line, values);
    refuse_bad_time(values[time], row.line);
    unfold(values);
    if (broken_ && m_.size() > 0) m_.breaks.push_back(m_.size());
    broken_ = false;
    if (turns_ != (m_.unfoldings.empty() ? 0.0 : m_.unfoldings.back().added_rad))
      m_.unfoldings.push_back({m_.size(), turns_});
    m_.time_s.push_back(values[time]);
    if (place_[voltage]) m_.voltage_v.push_back(values[voltage]);
    if (place_[cart]) m_.cart_m.push_back(values[cart]);
    if (place_[theta]) m_.theta_rad.push_back(values[theta]);
  }

  /// Where the stamps only scatter, the rows themselves are the clock.
  void count_time(double& time_s) {
    if (sources_[time]->period_s == 0.0) return;
    if (std::isfinite(time_s)) {
      if (rows_ == 0) first_stamp_s_ = time_s;
      last_stamp_s_ = time_s;
    }
    last_counted_s_ = first_stamp_s_ + sources_[time]->period_s * static_cast<double>(rows_++);
    time_s = last_counted_s_;
  }

  /// Stamps scatter about the rows' clock and stay near it; else the period is another or rows are missing.
  void refuse_missing_rows() const {
    constexpr double max_periods = 10.0, max_share = 0.001;
    const double period_s = sources_[time]->period_s, off_s = last_stamp_s_ - last_counted_s_;
    if (period_s == 0.0 || rows_ < 2 ||
        std::abs(off_s) <= max_periods * period_s + max_share * (last_counted_s_ - first_stamp_s_))
      return;
    throw ConfigError(
        dataset_.file.string() + ": the time stamps end " + exact_text(off_s) +
        " s after the last row according to period_s, so period_s is wrong or rows are missing: "
        "correct period_s (" +
        exact_text((last_stamp_s_ - first_stamp_s_) / static_cast<double>(rows_ - 1)) +
        " s would agree with the time stamps) or restore the rows");
  }

  void leave_out(std::size_t line, const std::array<double, 4>& values) {
    if (dataset_.missing == MissingCells::stop)
      for (std::size_t q = 0; q < values.size(); ++q)
        if (!std::isfinite(values[q]))
          throw ConfigError(dataset_.file.string() + ":" + std::to_string(line) + ": " + sources_[q]->column +
                            " holds no number, and the dataset file has missing: stop: correct the row, or "
                            "set missing to gap or skip");
    if (missing_rows_++ == 0) first_missing_line_ = line;
    broken_ = broken_ || dataset_.missing == MissingCells::gap;
  }

  void refuse_bad_time(double time_s, std::size_t line) const {
    if (m_.time_s.empty() || time_s > m_.time_s.back()) return;
    throw ConfigError(dataset_.file.string() + ":" + std::to_string(line) + ": time_s does not increase (" +
                      exact_text(m_.time_s.back()) + " then " + exact_text(time_s) +
                      "): sort the rows by time and remove duplicates; if the time was rounded, write it "
                      "with more digits; if the rows are in order and have a constant rate, give time_s a "
                      "period_s in a dataset file (docs/reference/dataset-files.md)");
  }

  /// Undoes the wrap of an angle that was folded, mostly into one turn: no real pendulum turns half around
  /// between two rows.
  void unfold(std::array<double, 4>& values) {
    double& angle = values[theta];
    if (!place_[theta] || !std::isfinite(angle)) return;
    const double every = sources_[theta]->folded_every_rad;
    if (has_angle_) turns_ -= every * std::round((angle + turns_ - last_angle_) / every);
    angle += turns_;
    last_angle_ = angle;
    has_angle_ = true;
  }

  const Dataset& dataset_;
  Measurement& m_;
  std::vector<DatasetColumn*> sources_;
  std::string row_word_ = "line";
  std::vector<std::string> wanted_;
  std::vector<std::optional<std::size_t>> place_;
  std::size_t missing_rows_ = 0, first_missing_line_ = 0;
  bool broken_ = false, has_angle_ = false;
  double turns_ = 0.0, last_angle_ = 0.0;
  std::size_t rows_ = 0;
  double first_stamp_s_ = 0.0, last_stamp_s_ = 0.0, last_counted_s_ = 0.0;
};

/// A record of which too little is left.
void refuse_too_short(const Measurement& m, const Dataset& dataset) {
  constexpr std::size_t min_samples = 10;
  if (m.size() >= min_samples) return;
  const std::string head = dataset.file.string() + ":1: " + std::to_string(m.size()) + " samples" +
                           (m.missing_rows > 0 ? " without a missing cell" : "") +
                           (dataset.from_s || dataset.to_s ? " from from_s to to_s" : "") +
                           ", fewer than 10, which is too few: ";
  throw ConfigError(head + (m.missing_rows > 0               ? "fill the empty cells"
                            : dataset.from_s || dataset.to_s ? "widen from_s and to_s"
                                                             : "record a longer run"));
}

/// Gaps so near to each other that nothing is left to be followed between them.
void refuse_gaps_everywhere(const Measurement& m, const Dataset& dataset) {
  // A fit begins 0.1 s after a gap (cut_segments), and a quarter of a second is the least it can judge.
  constexpr double min_s = 0.35;
  double longest_s = 0.0;
  std::size_t first = 0;
  for (std::size_t i = 0; i <= m.breaks.size(); ++i) {
    const std::size_t end = i < m.breaks.size() ? m.breaks[i] : m.size();
    longest_s = std::max(longest_s, m.time_s[end - 1] - m.time_s[first]);
    first = end;
  }
  if (m.breaks.empty() || longest_s >= min_s) return;
  throw ConfigError(
      dataset.file.string() + ": " + std::to_string(m.missing_rows) +
      " rows have a cell without a number, at most " + exact_text(longest_s) +
      " s apart, so no stretch is long enough to analyse: set missing: skip in a dataset file if "
      "a sensor is written less often than the rows, otherwise fill the cells");
}

Measurement load(Dataset dataset, const std::string& name) {
  Measurement m;
  m.name = name;
  m.cart_locked = dataset.cart_locked;
  Collector(dataset, m).read();
  m.dataset = std::make_shared<const Dataset>(dataset);
  refuse_too_short(m, dataset);
  refuse_gaps_everywhere(m, dataset);
  if (m.voltage_v.empty()) m.voltage_v.assign(m.size(), 0.0);
  const bool still =
      (m.cart_m.empty() || is_constant(m.cart_m)) && (m.theta_rad.empty() || is_constant(m.theta_rad));
  if (still) throw NothingMoves(dataset.file.string() + " holds constant data: record a run with motion");
  const auto angle = dataset.columns.find("theta_rad");
  if (angle != dataset.columns.end() && angle->second.mirrored) unmirror(m.theta_rad);
  m.cart_resolution_m = dataset.cart_resolution_m.value_or(find_resolution(m.cart_m));
  m.theta_resolution_rad = dataset.theta_resolution_rad.value_or(find_resolution(m.theta_rad));
  if (m.cart_resolution_m > 0.0) m.cart_weight = dwell_weights(m.cart_m);
  if (m.theta_resolution_rad > 0.0) m.theta_weight = dwell_weights(m.theta_rad);
  const bool motor_off = is_constant(m.voltage_v) && m.voltage_v.front() == 0.0;
  if (m.cart_m.empty() && motor_off && !m.cart_locked) {
    m.cart_locked = true;
    m.notes.push_back(name + ": no cart position and no voltage, so the cart is taken as held");
  }
  if (m.has_cart() && m.cart_locked) m.cart_m.clear();
  m.known_cart_noise_m = m.cart_noise_m();
  m.known_theta_noise_rad = m.theta_noise_rad();
  undo_delays(m, dataset);
  return m;
}

/// A run directory's mapping, with the time of recording as a label. Of an experiment's run, what somebody's
/// hands did is left out: before the pendulum was let go no equation of motion holds.
Dataset mapping_of_run(const fs::path& directory) {
  Dataset mapping = plain_dataset(directory / "samples.csv");
  std::error_code problem;
  if (!fs::exists(directory / "run.yaml", problem)) return mapping;
  const YamlMap document = YamlMap::from_file(directory / "run.yaml");
  mapping.labels["recorded"] = document.text_or("started_utc", "");
  if (!document.has("experiment")) return mapping;
  const Piece piece = read_piece(document.map("experiment").map("piece"));
  const bool decays = piece.as<pieces::FreeDecay>() != nullptr;
  if (!decays && !balances(piece)) return mapping;
  const std::vector<LogRecord> rows = read_samples(mapping.file).rows;
  std::size_t from = 0;
  if (decays) {
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
  // Repeated values, and steps of a few quanta, show that a signal is quantised. One step that is small by
  // chance does not. Two of five other steps are as close to a multiple of it as is allowed below.
  constexpr std::ptrdiff_t min_shown = 8;
  const auto repeated = static_cast<std::ptrdiff_t>(values.size() - 1 - steps.size());
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
    const std::ptrdiff_t examined = std::upper_bound(real, steps.end(), largest) - real;
    if (examined + repeated < min_shown || off > 0.05 * static_cast<double>(examined)) return 0.0;
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
  constexpr double median_to_sigma = 1.0 / median_of_gaussian_magnitudes;
  return median_of(std::move(fourth)) * median_to_sigma /
         std::sqrt(70.0);  // the squares of 1 4 6 4 1 add up to 70
}

double Measurement::median_period_s() const {
  std::vector<double> steps;
  for (std::size_t k = 1; k < time_s.size(); ++k) steps.push_back(time_s[k] - time_s[k - 1]);
  return median_of(std::move(steps));
}

double Measurement::cart_noise_m() const {
  if (known_cart_noise_m) return *known_cart_noise_m;
  const double step = cart_resolution_m / std::sqrt(12.0);
  return std::max({step, cart_resolution_m > 0.0 ? 0.0 : find_noise(cart_m), 1e-9});
}

double Measurement::theta_noise_rad() const {
  if (known_theta_noise_rad) return *known_theta_noise_rad;
  const double step = theta_resolution_rad / std::sqrt(12.0);
  return std::max({step, theta_resolution_rad > 0.0 ? 0.0 : find_noise(theta_rad), 1e-9});
}

Measurement read_measurement(const fs::path& path) {
  std::error_code problem;
  if (fs::is_directory(path, problem)) {
    const fs::path samples = path / "samples.csv";
    if (!fs::exists(samples, problem))
      throw ConfigError(path.string() +
                        " has no samples.csv: give a run directory, a CSV file or a dataset file");
    return load(mapping_of_run(path),
                path.filename().empty() ? path.parent_path().filename().string() : path.filename().string());
  }
  const std::string extension = path.extension().string();
  if (extension == ".yaml" || extension == ".yml") return load(read_dataset_file(path), path.stem().string());
  return load(plain_dataset(path), path.stem().string());
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
