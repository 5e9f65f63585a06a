// Strict reading of YAML maps: every key is asked for by name with its type and range; whatever is missing,
// unknown, doubled, of the wrong type, not finite or out of range is a ConfigError that gives remedy, file,
// line and key.
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

/// The closed or half-open interval a number must lie in.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;  ///< the low end itself is refused

  static constexpr Range any() { return {}; }
  static constexpr Range positive() { return {0.0, std::numeric_limits<double>::infinity(), true}; }
  static constexpr Range not_negative() { return {0.0, std::numeric_limits<double>::infinity(), false}; }
  static constexpr Range within(double low, double high) { return {low, high, false}; }

  constexpr bool contains(double value) const {
    return (low_open ? value > low : value >= low) && value <= high;
  }
  std::string text() const;
};

/// The name among `known` nearest to `word` by edit distance; empty when none is near enough to be meant.
std::string nearest_name(std::string_view word, const std::vector<std::string>& known);

/// A number as text that reads back to the same bits (shortest form).
std::string exact_text(double value);

/// One YAML map being read. Cheap to copy; copies share the record of which keys were asked for.
class YamlMap {
 public:
  /// Reads a whole file, whose top level must be a map. Files over 16 MiB are refused.
  static YamlMap from_file(const std::filesystem::path& file);
  /// The same from text; `file` is the name that errors show.
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
  /// A text that must be one of `names`; the error lists them and points at the nearest.
  std::string choice(const std::string& key, const std::vector<std::string>& names) const;
  std::vector<double> numbers(const std::string& key, const Range& range = {}) const;
  YamlMap map(const std::string& key) const;
  std::optional<YamlMap> optional_map(const std::string& key) const;
  std::vector<YamlMap> maps(const std::string& key) const;
  /// True when the key is there and holds a plain value, a map or a list.
  bool is_scalar(const std::string& key) const;
  bool is_map(const std::string& key) const;
  bool is_list(const std::string& key) const;
  std::vector<std::string> keys() const;

  /// Refuses every key that was never asked for. Call it when the map is read.
  void finish() const;

  /// Throws the error for `key` of this map: "remedy: file:line: path.key problem".
  [[noreturn]] void fail(const std::string& key, const std::string& problem, const std::string& remedy) const;

  const std::filesystem::path& file() const;
  /// A path given in this file, relative to the folder the file is in.
  std::filesystem::path path(const std::string& key) const;

 private:
  struct Node;
  explicit YamlMap(std::shared_ptr<Node> node) : node_(std::move(node)) {}
  std::shared_ptr<Node> node_;
};

/// A text in single quotes, as a YAML scalar that reads back the same. Control characters become spaces.
std::string yaml_quoted(const std::string& text);

}  // namespace upright
