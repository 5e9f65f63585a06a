#include "upright/runtime/run_reader.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string_view>

#include "upright/model/error.hpp"
#include "upright/model/plant_file.hpp"

namespace upright {

namespace {

enum Column : std::size_t {
  tick,
  time_s,
  cart_counts,
  pendulum_counts,
  cart_m,
  theta_rad,
  cart_velocity,
  pendulum_rate,
  requested_v,
  voltage_v,
  wake_late,
  read_us,
  compute_us,
  write_us,
  flags,
  sequence,
  column_count
};

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> parts;
  std::size_t begin = 0;
  for (;;) {
    const std::size_t comma = line.find(',', begin);
    parts.push_back(line.substr(begin, comma - begin));
    if (comma == std::string_view::npos) return parts;
    begin = comma + 1;
  }
}

template <class Number>
bool parse(std::string_view text, Number& value) {
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  return result.ec == std::errc{} && result.ptr == text.data() + text.size();
}

bool parse_ns(std::string_view text, double per_unit, std::int64_t& value) {
  double units = 0.0;
  if (!parse(text, units) || !(std::abs(units * per_unit) < 9e18)) return false;
  value = std::llround(units * per_unit);
  return true;
}

/// Where the columns of a file are; `nowhere` for one that is missing and may be.
class Header {
 public:
  Header(std::string_view line, const std::filesystem::path& file) {
    const std::vector<std::string_view> present = split(line);
    width_ = present.size();
    const std::vector<std::string_view> known = split(sample_columns);
    for (std::size_t i = 0; i < known.size(); ++i) {
      place_[i] = nowhere;
      for (std::size_t j = 0; j < present.size(); ++j)
        if (present[j] == known[i]) place_[i] = j;
      if (place_[i] == nowhere && i != sequence)
        throw ConfigError("restore the header line: " + file.string() + ":1: the column " +
                          std::string(known[i]) + " is missing");
    }
  }

  bool read(std::string_view line, std::vector<std::string_view>& cells, LogRecord& r) const {
    cells.clear();
    std::size_t begin = 0;
    for (std::size_t end = line.find(','); end != std::string_view::npos; end = line.find(',', begin)) {
      cells.push_back(line.substr(begin, end - begin));
      begin = end + 1;
    }
    cells.push_back(line.substr(begin));
    if (cells.size() != width_) return false;
    const auto cell = [&](Column column) { return cells[place_[column]]; };
    return parse(cell(tick), r.tick) && parse_ns(cell(time_s), 1e9, r.time_ns) &&
           parse(cell(cart_counts), r.cart_counts) && parse(cell(pendulum_counts), r.pendulum_counts) &&
           parse(cell(cart_m), r.cart_m) && parse(cell(theta_rad), r.theta_rad) &&
           parse(cell(cart_velocity), r.cart_velocity_mps) &&
           parse(cell(pendulum_rate), r.pendulum_rate_radps) &&
           parse(cell(requested_v), r.voltage_requested_v) && parse(cell(voltage_v), r.voltage_v) &&
           parse_ns(cell(wake_late), 1e3, r.wake_late_ns) && parse_ns(cell(read_us), 1e3, r.read_ns) &&
           parse_ns(cell(compute_us), 1e3, r.compute_ns) && parse_ns(cell(write_us), 1e3, r.write_ns) &&
           parse(cell(flags), r.flags) && (place_[sequence] == nowhere || parse(cell(sequence), r.sequence));
  }

 private:
  static constexpr std::size_t nowhere = static_cast<std::size_t>(-1);
  std::array<std::size_t, column_count> place_{};
  std::size_t width_ = 0;
};

/// Nothing but what a power cut leaves behind the last row: blanks and bytes never written.
bool is_waste(std::string_view text) {
  constexpr std::string_view waste("\0\n\r", 3);
  return text.find_first_not_of(waste) == std::string_view::npos;
}

}  // namespace

Samples read_samples(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw ConfigError("name a run directory: cannot read " + file.string());
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const std::string_view all(text);
  std::size_t end = all.find('\n');
  Samples samples;
  if (end == std::string_view::npos) {
    samples.truncated = true;
    return samples;
  }
  const Header header(all.substr(0, end), file);
  std::vector<std::string_view> cells;
  std::size_t line_number = 2;
  for (std::size_t begin = end + 1; begin < all.size(); begin = end + 1, ++line_number) {
    end = all.find('\n', begin);
    if (end == std::string_view::npos) {
      samples.truncated = true;
      break;
    }
    LogRecord row;
    if (header.read(all.substr(begin, end - begin), cells, row)) {
      samples.rows.push_back(row);
      continue;
    }
    if (!is_waste(all.substr(end)) && !is_waste(all.substr(begin)))
      throw ConfigError("restore the line from a copy: " + file.string() + ":" + std::to_string(line_number) +
                        ": not a row of samples");
    samples.truncated = true;
    break;
  }
  return samples;
}

RunRecord read_run(const std::filesystem::path& directory) {
  std::error_code problem;
  if (!std::filesystem::is_directory(directory, problem))
    throw ConfigError("name a run directory: " + directory.string() + " is none");
  if (!std::filesystem::exists(directory / "run.yaml", problem))
    throw ConfigError("name a run directory: " + directory.string() + " has no run.yaml");
  const YamlMap document = YamlMap::from_file(directory / "run.yaml");
  const YamlMap run = document.map("run");
  RunRecord record{directory,
                   document,
                   run.text_or("label", ""),
                   run.text("started_utc"),
                   run.number("duration_s", Range::not_negative()),
                   read_gains(document.map("controller")),
                   read_rig(document.map("rig")),
                   std::nullopt,
                   document.optional_map("outcome"),
                   {}};
  if (document.has("plant")) record.plant = read_plant(document);
  record.samples = read_samples(directory / "samples.csv");
  return record;
}

}  // namespace upright
