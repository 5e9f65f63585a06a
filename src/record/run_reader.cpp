#include "upright/record/run_reader.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "base/input_file.hpp"
#include "upright/base/error.hpp"
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
        throw ConfigError(file.string() + ":1: the column " + std::string(known[i]) +
                          " is missing: restore the header line");
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
bool is_padding(std::string_view text) {
  constexpr std::string_view waste("\0\n\r", 3);
  return text.find_first_not_of(waste) == std::string_view::npos;
}

/// A file line by line, through a buffer that only a longer line makes grow.
class Lines {
 public:
  explicit Lines(const std::filesystem::path& file) : in_(file) {}

  /// Without its end; false when no further line is complete.
  bool next(std::string_view& line) {
    for (std::size_t searched = begin_;;) {
      const std::size_t end = text_.find('\n', searched);
      if (end != std::string::npos) {
        line = std::string_view(text_).substr(begin_, end - begin_);
        begin_ = end + 1;
        return true;
      }
      searched = text_.size() - begin_;
      if (is_too_long() || !read_more()) return false;
    }
  }

  /// What follows is no line of ours, whether it ends or not.
  bool is_too_long() const { return text_.size() - begin_ > longest_line; }

  /// What follows the last complete line holds something, be it a cut line.
  bool has_rest() const { return begin_ < text_.size(); }

  /// Of the file's bytes, those that were taken from it.
  double share_read() const {
    return in_.bytes() > 0 ? static_cast<double>(taken_) / static_cast<double>(in_.bytes()) : 1.0;
  }

  /// Everything from here on is waste.
  bool rest_is_padding() {
    do {
      if (!is_padding(std::string_view(text_).substr(begin_))) return false;
      begin_ = text_.size();
    } while (read_more());
    return true;
  }

 private:
  static constexpr std::size_t part_bytes = 1 << 20, longest_line = 1 << 20;

  /// Brings the unread text to the front and appends what comes.
  bool read_more() {
    text_.erase(0, begin_);
    begin_ = 0;
    const std::size_t kept = text_.size();
    text_.resize(kept + part_bytes);
    in_.read(text_.data() + kept, part_bytes);
    text_.resize(kept + static_cast<std::size_t>(in_.gcount()));
    in_.check();
    taken_ += static_cast<std::uintmax_t>(in_.gcount());
    return text_.size() > kept;
  }

  InputFile in_;
  std::string text_;
  std::size_t begin_ = 0;
  std::uintmax_t taken_ = 0;
};

}  // namespace

class SampleReader::Implementation {
 public:
  explicit Implementation(const std::filesystem::path& file) : file_(file), lines_(file) {
    std::string_view line;
    if (lines_.next(line))
      header_.emplace(line, file);
    else
      truncated_ = true;
  }

  bool next(LogRecord& row) {
    std::string_view line;
    if (truncated_) return false;
    const bool complete = lines_.next(line);
    if (!complete && !lines_.is_too_long()) {
      truncated_ = lines_.has_rest();
      return false;
    }
    ++line_number_;
    if (complete && header_->read(line, cells_, row)) return true;
    if (!lines_.rest_is_padding())
      throw ConfigError(file_.string() + ":" + std::to_string(line_number_) +
                        ": this line is not a row of samples: restore it from a copy");
    truncated_ = true;
    return false;
  }

  bool truncated() const noexcept { return truncated_; }
  double share_read() const noexcept { return lines_.share_read(); }

 private:
  std::filesystem::path file_;
  Lines lines_;
  std::optional<Header> header_;
  std::vector<std::string_view> cells_;
  std::size_t line_number_ = 1;
  bool truncated_ = false;
};

SampleReader::SampleReader(const std::filesystem::path& file)
    : implementation_(std::make_unique<Implementation>(file)) {}

SampleReader::~SampleReader() = default;

bool SampleReader::next(LogRecord& row) {
  return implementation_->next(row);
}

bool SampleReader::truncated() const noexcept {
  return implementation_->truncated();
}

double SampleReader::share_read() const noexcept {
  return implementation_->share_read();
}

Samples read_samples(const std::filesystem::path& file) {
  SampleReader reader(file);
  Samples samples;
  for (LogRecord row; reader.next(row); row = {}) samples.rows.push_back(row);
  samples.truncated = reader.truncated();
  return samples;
}

RunRecord read_run_without_samples(const std::filesystem::path& directory) {
  std::error_code problem;
  if (!std::filesystem::is_directory(directory, problem))
    throw ConfigError(directory.string() + " is not a folder: name a run directory");
  if (!std::filesystem::exists(directory / "run.yaml", problem))
    throw ConfigError(directory.string() + " has no run.yaml: name a run directory");
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
  return record;
}

RunRecord read_run(const std::filesystem::path& directory) {
  RunRecord record = read_run_without_samples(directory);
  record.samples = read_samples(directory / "samples.csv");
  return record;
}

}  // namespace upright
