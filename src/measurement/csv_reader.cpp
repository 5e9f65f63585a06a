#include "csv_reader.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>

#include "base/input_file.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

namespace fs = std::filesystem;
using std::string_view;
using namespace std::string_view_literals;

constexpr std::size_t block_bytes = 1u << 20;
/// No row of numbers is longer; a file without line ends would otherwise be held as a whole.
constexpr std::size_t longest_line_bytes = 4u << 20;
constexpr std::size_t shown_bytes = 40;  ///< of a cell, in messages
constexpr double missing = std::numeric_limits<double>::quiet_NaN();

[[noreturn]] void refuse(const fs::path& file, std::size_t line, const std::string& cause,
                         const std::string& remedy) {
  throw ConfigError(file.string() + ":" + std::to_string(line) + ": " + cause + ": " + remedy);
}

/// What a file is that is no text, by its first bytes.
struct Signature {
  string_view bytes;
  std::size_t at;
  const char* what;
  const char* remedy;
};

constexpr const char* from_hdf5 = "export the signals as text, in Python with h5py and numpy.savetxt";
constexpr const char* from_utf16 = "convert it with iconv -f UTF-16 -t UTF-8 FILE > measured.csv";
constexpr const char* from_spreadsheet = "export the sheet as CSV";
constexpr const char* from_archive = "unpack it first";

constexpr std::array signatures = {
    Signature{"\x89HDF\r\n\x1a\n"sv, 0, "an HDF5 file", from_hdf5},
    Signature{"\xff\xfe"sv, 0, "UTF-16 text", from_utf16},
    Signature{"\xfe\xff"sv, 0, "UTF-16 text", from_utf16},
    Signature{"PK\x03\x04"sv, 0, "a spreadsheet or a zip archive", from_spreadsheet},
    Signature{"\xd0\xcf\x11\xe0"sv, 0, "an old spreadsheet", from_spreadsheet},
    Signature{"\x1f\x8b"sv, 0, "a gzip archive", from_archive},
    Signature{"PAR1"sv, 0, "a Parquet file", "export the table as CSV"},
    Signature{"\x93NUMPY"sv, 0, "a numpy array", "write it with numpy.savetxt"},
};

void refuse_what_is_no_text(const fs::path& file, string_view block) {
  for (const Signature& s : signatures)
    if (block.size() >= s.at + s.bytes.size() && block.substr(s.at, s.bytes.size()) == s.bytes)
      refuse(file, 1, std::string("this is ") + s.what + ", not a text table", s.remedy);
  const std::size_t zero = block.find('\0');
  if (zero == string_view::npos) return;
  // Latin text in UTF-16 has a zero in every second byte.
  const auto zeros = static_cast<std::size_t>(std::count(block.begin(), block.end(), '\0'));
  if (zeros * 3 > block.size())
    refuse(file, 1, "this is UTF-16 text without a byte order mark, not UTF-8", from_utf16);
  const auto line = 1 + std::count(block.begin(), block.begin() + static_cast<std::ptrdiff_t>(zero), '\n');
  refuse(file, static_cast<std::size_t>(line), "the line contains a zero byte, so this is not a text table",
         "export the signals as CSV");
}

/// A file by lines, a block at a time.
class Lines {
 public:
  explicit Lines(const fs::path& file) : file_(file), in_(file) {
    fill();
    refuse_what_is_no_text(file, buffer_);
    constexpr string_view mark = "\xef\xbb\xbf";
    if (string_view(buffer_).substr(0, mark.size()) == mark) at_ = mark.size();
    // Old programs end lines with a carriage return alone.
    if (buffer_.find('\n') == std::string::npos && buffer_.find('\r') != std::string::npos) end_ = '\r';
  }

  /// The next line without its end; nothing at the end of the file.
  std::optional<string_view> next() {
    for (;;) {
      const std::size_t end = buffer_.find(end_, std::max(at_, searched_));
      if (end != std::string::npos) {
        const string_view line = string_view(buffer_).substr(at_, end - at_);
        at_ = searched_ = end + 1;
        ++number_;
        return line;
      }
      searched_ = buffer_.size();
      if (buffer_.size() - at_ > longest_line_bytes)
        refuse(file_, number_ + 1, "the line is longer than 4 MiB, so this is not a table",
               "export it as CSV");
      if (fill()) continue;
      if (at_ >= buffer_.size()) return std::nullopt;
      cut_off_ = true;
      ++number_;
      const string_view line = string_view(buffer_).substr(at_);
      at_ = buffer_.size();
      return line;
    }
  }

  std::size_t number() const { return number_; }
  bool cut_off() const { return cut_off_; }  ///< the last line has no end

 private:
  bool fill() {
    buffer_.erase(0, at_);
    searched_ -= std::min(searched_, at_);
    at_ = 0;
    const std::size_t had = buffer_.size();
    buffer_.resize(had + block_bytes);
    in_.read(buffer_.data() + had, block_bytes);
    buffer_.resize(had + static_cast<std::size_t>(std::max<std::streamsize>(in_.gcount(), 0)));
    return buffer_.size() > had;
  }

  const fs::path& file_;
  InputFile in_;
  std::string buffer_;
  std::size_t at_ = 0, searched_ = 0, number_ = 0;
  char end_ = '\n';
  bool cut_off_ = false;
};

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

string_view trimmed(string_view cell) {
  while (!cell.empty() && is_blank(cell.front())) cell.remove_prefix(1);
  while (!cell.empty() && is_blank(cell.back())) cell.remove_suffix(1);
  return cell;
}

string_view unquoted(string_view cell) {
  cell = trimmed(cell);
  if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') {
    cell.remove_prefix(1);
    cell.remove_suffix(1);
  }
  return trimmed(cell);
}

/// Cuts a line into cells, the quoted ones whole. Runs of spaces are one delimiter.
void split(string_view line, char delimiter, std::vector<string_view>& cells) {
  cells.clear();
  if (delimiter == ' ') line = trimmed(line);
  std::size_t begin = 0;
  while (begin <= line.size()) {
    std::size_t end = begin;
    bool quoted = false;
    while (end < line.size() && (quoted || line[end] != delimiter)) quoted ^= line[end++] == '"';
    cells.push_back(unquoted(line.substr(begin, end - begin)));
    if (delimiter == ' ')
      while (end + 1 < line.size() && is_blank(line[end + 1])) ++end;
    begin = end + 1;
  }
}

bool is_comment(string_view line) {
  line = trimmed(line);
  return line.empty() || line.front() == '#' || line.front() == '%';
}

/// How programs write that there is no number.
bool says_missing(string_view cell) {
  std::string low(cell.substr(0, 8));
  std::transform(low.begin(), low.end(), low.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  if (!low.empty() && (low.front() == '+' || low.front() == '-')) low.erase(0, 1);
  constexpr std::array words = {""sv,    "nan"sv, "na"sv,  "n/a"sv,      "#n/a"sv,    "null"sv,   "none"sv,
                                "nil"sv, "."sv,   "inf"sv, "infinity"sv, "1.#qnan"sv, "1.#ind"sv, "1.#inf"sv};
  return cell.size() <= 8 && std::find(words.begin(), words.end(), low) != words.end();
}

/// Reads numbers with one kind of decimal sign, which the first that has one settles.
class Numbers {
 public:
  Numbers(std::optional<char> decimal, char delimiter)
      : decimal_(decimal), comma_allowed_(delimiter != ',') {}

  /// Nothing where the cell is no number.
  std::optional<double> read(string_view cell) {
    if (comma_allowed_ && cell.find(',') != string_view::npos) return read_with_comma(cell);
    const bool has_point = cell.find('.') != string_view::npos;
    if (has_point && decimal_ == ',') return std::nullopt;
    const auto value = plain(cell);
    if (value && has_point) decimal_ = '.';
    return value;
  }

 private:
  static std::optional<double> plain(string_view cell) {
    if (!cell.empty() && cell.front() == '+') cell.remove_prefix(1);
    double value = 0.0;
    const char* last = cell.data() + cell.size();
    const auto result = std::from_chars(cell.data(), last, value);
    if (result.ec != std::errc{} || result.ptr != last) return std::nullopt;
    return value;
  }

  std::optional<double> read_with_comma(string_view cell) {
    std::array<char, 64> text;
    if (decimal_ == '.' || cell.size() > text.size() || cell.find('.') != string_view::npos)
      return std::nullopt;
    std::copy(cell.begin(), cell.end(), text.begin());
    std::replace(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(cell.size()), ',', '.');
    const auto value = plain({text.data(), cell.size()});
    if (value) decimal_ = ',';
    return value;
  }

  std::optional<char> decimal_;
  bool comma_allowed_;
};

/// The delimiter that cuts the first lines alike: one that is in the header alone is part of a name.
char find_delimiter(string_view first, string_view second) {
  constexpr std::array candidates = {';', '\t', ',', ' '};
  std::vector<string_view> a, b;
  for (const char delimiter : candidates) {
    split(first, delimiter, a);
    split(second, delimiter, b);
    if (a.size() > 1 && a.size() == b.size()) return delimiter;
  }
  for (const char delimiter : candidates) {
    split(first, delimiter, a);
    if (a.size() > 1) return delimiter;
  }
  return ',';
}

/// Reads one file's rows.
class Reader {
 public:
  Reader(const fs::path& file, const std::vector<std::string>& wanted, const CsvFormat& format)
      : file_(file), wanted_(wanted), format_(format), lines_(file) {}

  CsvTable run(const CsvHead& head, const CsvSink& sink) {
    std::string first, second;
    std::size_t first_line = 0, second_line = 0;
    take(first, first_line);
    take(second, second_line);
    delimiter_ = format_.delimiter.value_or(find_delimiter(first, second));
    numbers_.emplace(format_.decimal, delimiter_);
    split(first, delimiter_, cells_);
    name_columns(first_line);
    if (!format_.header) {
      head(table_);
      take_row(first_line, sink);
    }
    if (second_line != 0) {
      split(second, delimiter_, cells_);
      const bool units = format_.header && holds_units();
      if (format_.header) head(table_);
      if (!units) take_row(second_line, sink);
    } else if (format_.header) {
      head(table_);
    }
    while (const auto line = lines_.next()) {
      if (is_comment(*line)) continue;
      split(*line, delimiter_, cells_);
      take_row(lines_.number(), sink);
    }
    return std::move(table_);
  }

 private:
  /// The next line that is no comment; number 0 where there is none.
  void take(std::string& text, std::size_t& number) {
    while (const auto line = lines_.next()) {
      if (is_comment(*line)) continue;
      text = *line;
      number = lines_.number();
      return;
    }
  }

  void name_columns(std::size_t line) {
    for (std::size_t i = 0; i < cells_.size(); ++i)
      table_.names.push_back(format_.header ? std::string(cells_[i]) : std::to_string(i + 1));
    if (line == 0) table_.names.clear();
    Numbers numbers = *numbers_;
    const bool all_numbers = std::all_of(cells_.begin(), cells_.end(), [&](string_view cell) {
      return !cell.empty() && numbers.read(cell).has_value();
    });
    if (format_.header && all_numbers && line != 0)
      refuse(file_, line, "the first row contains numbers instead of column names",
             "set header: false in a dataset file and name the columns by number");
    for (const std::string& name : wanted_) {
      const auto at = std::find(table_.names.begin(), table_.names.end(), name);
      table_.place.emplace_back();
      table_.units.emplace_back();
      if (name.empty() || at == table_.names.end()) continue;
      table_.place.back() = columns_.size();
      columns_.push_back(static_cast<std::size_t>(at - table_.names.begin()));
    }
    values_.resize(columns_.size());
  }

  /// A row under the header in which words stand where numbers belong.
  bool holds_units() {
    bool words = false;
    for (const std::size_t column : columns_) {
      if (column >= cells_.size()) return false;
      Numbers numbers = *numbers_;
      if (numbers.read(cells_[column])) return false;
      words = words || !says_missing(cells_[column]);
    }
    if (!words) return false;
    for (std::size_t i = 0; i < wanted_.size(); ++i)
      if (table_.place[i]) table_.units[i] = std::string(cells_[columns_[*table_.place[i]]]);
    return true;
  }

  void take_row(std::size_t line, const CsvSink& sink) {
    if (lines_.cut_off() && line == lines_.number() && cells_.size() < table_.names.size()) return;
    refuse_extra_cells(line);
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      values_[i] = missing;
      if (columns_[i] >= cells_.size()) continue;
      const string_view cell = cells_[columns_[i]];
      const auto value = numbers_->read(cell);
      if (value && std::isfinite(*value)) {
        values_[i] = *value;
      } else if (!value && !says_missing(cell)) {
        refuse_cell(line, i, cell);
      }
    }
    sink({line, values_});
  }

  void refuse_extra_cells(std::size_t line) const {
    if (cells_.size() <= table_.names.size()) return;
    if (std::all_of(cells_.begin() + static_cast<std::ptrdiff_t>(table_.names.size()), cells_.end(),
                    [](string_view cell) { return cell.empty(); }))
      return;
    refuse(file_, line,
           "the row has " + std::to_string(cells_.size()) + " cells, but the table has " +
               std::to_string(table_.names.size()) + " columns",
           delimiter_ == ',' ? "if it has decimal commas, export it with semicolons between the cells; "
                               "otherwise correct the row"
                             : "correct the row, or set delimiter in a dataset file");
  }

  [[noreturn]] void refuse_cell(std::size_t line, std::size_t column, string_view cell) const {
    const bool sign = cell.find_first_of(".,") != string_view::npos &&
                      cell.find_first_not_of("0123456789.,+-eE") == string_view::npos;
    std::string shown;
    for (const char c : cell.substr(0, shown_bytes)) shown += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
    refuse(file_, line,
           table_.names[columns_[column]] + " is '" + shown + "', not a finite number" +
               (sign ? " with the decimal sign of this file" : ""),
           sign ? "write all numbers with the same decimal sign and without separators of thousands, or set "
                  "decimal in a dataset file"
                : "correct the row or remove it");
  }

  const fs::path& file_;
  const std::vector<std::string>& wanted_;
  const CsvFormat& format_;
  Lines lines_;
  CsvTable table_;
  char delimiter_ = ',';
  std::optional<Numbers> numbers_;
  std::vector<std::size_t> columns_;  ///< of the file, in the order of a row's values
  std::vector<string_view> cells_;
  std::vector<double> values_;
};

}  // namespace

CsvTable read_csv(const fs::path& file, const std::vector<std::string>& wanted, const CsvFormat& format,
                  const CsvHead& head, const CsvSink& sink) {
  return Reader(file, wanted, format).run(head, sink);
}

}  // namespace upright
