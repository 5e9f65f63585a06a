// Strict reading of YAML maps. Each key is requested by name with its type and range. A key that is
// missing, unknown, duplicated, of the wrong type, not finite or out of range causes a ConfigError with
// remedy, file, line and key.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace upright {

/// The interval in which a number must lie, closed or half-open.
struct Range {
  double low = -std::numeric_limits<double>::infinity();  ///< the lower end
  double high = std::numeric_limits<double>::infinity();  ///< the upper end, included
  bool low_open = false;                                  ///< the lower end is excluded

  static constexpr Range any() { return {}; }  ///< every finite number
  /// Above zero.
  static constexpr Range positive() { return {0.0, std::numeric_limits<double>::infinity(), true}; }
  /// Zero or above.
  static constexpr Range not_negative() { return {0.0, std::numeric_limits<double>::infinity(), false}; }
  /// Both ends included.
  static constexpr Range within(double low, double high) { return {low, high, false}; }

  /// Whether the number lies in it.
  constexpr bool contains(double value) const {
    return (low_open ? value > low : value >= low) && value <= high;
  }
  std::string text() const;  ///< "from 0 to 1", "above 0", ..
};

/// The name in `known` with the smallest edit distance to `word`; empty when none is close enough.
std::string nearest_name(std::string_view word, const std::vector<std::string>& known);

/// A number in the shortest decimal form that reads back to the same bits.
std::string exact_text(double value);

/// One YAML map that is being read. Copies are cheap and share the record of requested keys.
class YamlMap {
 public:
  /// Reads a file whose top level is a map. Throws ConfigError for files larger than 16 MiB.
  static YamlMap from_file(const std::filesystem::path& file);
  /// Reads a text in the same way. Errors show `file` as its name.
  static YamlMap from_text(const std::string& text, const std::filesystem::path& file);

  bool has(const std::string& key) const;  ///< whether the key is there. It is known from now on.
  double number(const std::string& key, const Range& range = {}) const;  ///< A required number
  /// A number, or `fallback` without the key.
  double number_or(const std::string& key, double fallback, const Range& range = {}) const;
  /// A number, or nothing without the key.
  std::optional<double> optional_number(const std::string& key, const Range& range = {}) const;
  /// A required whole number, both ends included.
  std::int64_t integer(const std::string& key, std::int64_t low, std::int64_t high) const;
  /// A whole number, or `fallback` without the key.
  std::int64_t integer_or(const std::string& key, std::int64_t fallback, std::int64_t low,
                          std::int64_t high) const;
  /// true or false, or `fallback` without the key.
  bool flag_or(const std::string& key, bool fallback) const;
  std::string text(const std::string& key) const;  ///< A required text, not empty
  /// A text, or `fallback` without the key.
  std::string text_or(const std::string& key, const std::string& fallback) const;
  /// A text that must be one of `names`. The error lists them and suggests the nearest.
  std::string choice(const std::string& key, const std::vector<std::string>& names) const;
  /// A required list of numbers; may be empty.
  std::vector<double> numbers(const std::string& key, const Range& range = {}) const;
  YamlMap map(const std::string& key) const;                          ///< A required map
  std::optional<YamlMap> optional_map(const std::string& key) const;  ///< A map, or nothing without the key
  std::vector<YamlMap> maps(const std::string& key) const;  ///< A required list of maps; may be empty
  /// True when the key exists and its value is a scalar, a map or a list, respectively.
  bool is_scalar(const std::string& key) const;
  bool is_map(const std::string& key) const;   ///< whether the key holds a map
  bool is_list(const std::string& key) const;  ///< whether the key holds a list
  std::vector<std::string> keys() const;       ///< every key, in the order of the file

  /// Refuses all keys that were not requested. Call it after the last request.
  void finish() const;

  /// Throws the error for `key` of this map: "remedy: file:line: path.key problem".
  [[noreturn]] void fail(const std::string& key, const std::string& problem, const std::string& remedy) const;

  const std::filesystem::path& file() const;  ///< the file, as it was named
  /// A path from this file; a relative path is resolved against the folder of the file.
  std::filesystem::path path(const std::string& key) const;

 private:
  struct Node;
  explicit YamlMap(std::shared_ptr<Node> node) : node_(std::move(node)) {}
  std::shared_ptr<Node> node_;
};

/// A text as a single-quoted YAML scalar that reads back unchanged. Control characters become spaces.
std::string yaml_quoted(const std::string& text);

}  // namespace upright
