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
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;  ///< the lower end is excluded

  static constexpr Range any() { return {}; }
  static constexpr Range positive() { return {0.0, std::numeric_limits<double>::infinity(), true}; }
  static constexpr Range not_negative() { return {0.0, std::numeric_limits<double>::infinity(), false}; }
  static constexpr Range within(double low, double high) { return {low, high, false}; }

  constexpr bool contains(double value) const {
    return (low_open ? value > low : value >= low) && value <= high;
  }
  std::string text() const;
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

  bool has(const std::string& key) const;
  double number(const std::string& key, const Range& range = {}) const;
  double number_or(const std::string& key, double fallback, const Range& range = {}) const;
  std::optional<double> optional_number(const std::string& key, const Range& range = {}) const;
  std::int64_t integer(const std::string& key, std::int64_t low, std::int64_t high) const;
  std::int64_t integer_or(const std::string& key, std::int64_t fallback, std::int64_t low,
                          std::int64_t high) const;
  bool flag_or(const std::string& key, bool fallback) const;
  std::string text(const std::string& key) const;
  std::string text_or(const std::string& key, const std::string& fallback) const;
  /// A text that must be one of `names`. The error lists them and suggests the nearest.
  std::string choice(const std::string& key, const std::vector<std::string>& names) const;
  std::vector<double> numbers(const std::string& key, const Range& range = {}) const;
  YamlMap map(const std::string& key) const;
  std::optional<YamlMap> optional_map(const std::string& key) const;
  std::vector<YamlMap> maps(const std::string& key) const;
  /// True when the key exists and its value is a scalar, a map or a list, respectively.
  bool is_scalar(const std::string& key) const;
  bool is_map(const std::string& key) const;
  bool is_list(const std::string& key) const;
  std::vector<std::string> keys() const;

  /// Refuses all keys that were not requested. Call it after the last request.
  void finish() const;

  /// Throws the error for `key` of this map: "remedy: file:line: path.key problem".
  [[noreturn]] void fail(const std::string& key, const std::string& problem, const std::string& remedy) const;

  const std::filesystem::path& file() const;
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
