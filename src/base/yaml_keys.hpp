// The keys of a section of a YAML file as one list, in the order of the file. A visitor of the list reads
// the section, writes it, or makes its JSON Schema (src/schema).
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "upright/base/yaml_reader.hpp"

namespace upright {

constexpr std::nullopt_t required = std::nullopt;  ///< in place of a default

/// Whether the text contains keys whose value is the default.
enum class Usual : std::uint8_t { written, left_out };

/// The names of an enumeration's values, in order.
template <std::size_t N>
using Words = std::array<const char*, N>;

constexpr std::size_t any_size = std::numeric_limits<std::size_t>::max();

/// What a check admits beyond the type and the range of its key.
struct Admitted {
  std::optional<std::size_t> min_items, max_items;  ///< of a list or a map
  std::optional<double> min;                        ///< of a number
  bool zero_too = false;                            ///< besides numbers from `min` on
  bool not_zero = false;                            ///< of a number
  std::string pattern;                              ///< of a text, as a regular expression of ECMA-262
  std::size_t max_length = 0;                       ///< of a text; 0: any
};

/// Visits the keys of a section. A visitor overrides the functions that it needs, and may change the
/// values: pass a copy to one that only writes.
class YamlKeys {
 public:
  using Visit = std::function<void(YamlKeys&)>;
  using VisitItem = std::function<void(YamlKeys&, std::size_t)>;

  virtual ~YamlKeys() = default;

  virtual void number(const char* /*key*/, double& /*value*/, const Range& /*range*/,
                      std::optional<double> /*otherwise*/ = required, Usual /*usual*/ = Usual::written) {}
  virtual void numbers(const char* /*key*/, std::vector<double>& /*values*/, const Range& /*range*/) {}
  virtual void flag(const char* /*key*/, bool& /*value*/, bool /*otherwise*/ = false,
                    Usual /*usual*/ = Usual::left_out) {}
  virtual void text(const char* /*key*/, std::string& /*value*/,
                    const std::optional<std::string>& /*otherwise*/ = required,
                    Usual /*usual*/ = Usual::written) {}
  /// A map with free keys and a text for each, of files that are only read.
  virtual void texts(const char* /*key*/, std::map<std::string, std::string>& /*values*/) {}
  /// Relative to the folder of the file.
  virtual void path(const char* /*key*/, std::filesystem::path& /*value*/) {}
  /// A map of keys, on one line when written.
  virtual void map(const char* /*key*/, const Visit& /*visit*/) {}
  /// The same with one line per key when written.
  virtual void section(const char* key, const Visit& visit) { map(key, visit); }

  /// Whether the key is present (reading), or `is_set` (writing): for keys that may be left out.
  virtual bool given(const char* /*key*/, bool is_set) { return is_set; }
  /// The same where other keys depend on it.
  virtual bool decides_by_presence(const char* key, bool is_set) { return given(key, is_set); }
  /// Whether the text of a key matches a pattern, where other keys depend on it: `does` of the present value.
  virtual bool decides_by_pattern(const char* /*key*/, const std::string& /*pattern*/, bool does) {
    return does;
  }
  /// A map on which keys outside of it depend.
  virtual void deciding_map(const char* key, const Visit& visit) { map(key, visit); }
  /// Whether the key holds a map (reading), or `is_set` (writing).
  virtual bool is_map(const char* /*key*/, bool is_set) { return is_set; }
  /// The map that is being read; null when writing: for steps that apply to reading only.
  virtual const YamlMap* source() const { return nullptr; }
  /// Says that one of the keys must be there, which another check refuses otherwise.
  virtual void require_any(const std::vector<std::string>& /*keys*/) {}
  /// Says for people what a key means.
  virtual void describe(const char* /*key*/, const std::string& /*meaning*/) {}

  template <std::signed_integral Int>
  void integer(const char* key, Int& value, std::int64_t low, std::int64_t high,
               std::optional<std::int64_t> otherwise = required) {
    std::int64_t wide = value;
    whole_number(key, wide, low, high, otherwise);
    value = static_cast<Int>(wide);
  }
  /// An enumeration by its names; for bool, the names of false and true.
  template <class Enum, std::size_t N>
  void one_of(const char* key, Enum& value, const Words<N>& words,
              std::optional<std::type_identity_t<Enum>> otherwise = required) {
    auto at = static_cast<std::size_t>(value);
    choice(key, at, {words.begin(), words.end()},
           otherwise ? std::optional(static_cast<std::size_t>(*otherwise)) : required);
    value = static_cast<Enum>(at);
  }
  /// The same with words of a registry: `word` is the place of one.
  void one_of(const char* key, std::size_t& word, const std::vector<std::string>& words) {
    choice(key, word, words, required);
  }
  /// An optional enumeration.
  template <class Enum, std::size_t N>
  void optional_one_of(const char* key, std::optional<Enum>& value, const Words<N>& words) {
    if (given(key, value.has_value())) one_of(key, made(value), words);
  }
  /// An optional path.
  void optional_path(const char* key, std::filesystem::path& value) {
    if (given(key, !value.empty())) path(key, value);
  }
  /// An optional integer.
  void optional_integer(const char* key, std::optional<int>& value, std::int64_t low, std::int64_t high) {
    if (given(key, value.has_value())) integer(key, made(value), low, high);
  }
  /// An optional number.
  void optional_number(const char* key, std::optional<double>& value, const Range& range) {
    if (given(key, value.has_value())) number(key, made(value), range);
  }
  /// An optional map. `visit` receives the visitor and the value.
  template <class T, class VisitValue>
  void optional_map(const char* key, std::optional<T>& value, const VisitValue& visit) {
    if (given(key, value.has_value())) map(key, [&](YamlKeys& keys) { visit(keys, made(value)); });
  }
  /// A map that is optional when read and always written.
  void usual_map(const char* key, const Visit& visit) {
    if (given(key, true)) map(key, visit);
  }
  /// A section that is required when read, and written where it is set.
  template <class T, class VisitValue>
  void section_of(const char* key, std::optional<T>& value, const VisitValue& visit) {
    if (visits_unset() || value) section(key, [&](YamlKeys& keys) { visit(keys, made(value)); });
  }
  /// A list of maps.
  template <class T, class VisitValue>
  void items(const char* key, std::vector<T>& values, const VisitValue& visit) {
    maps(key, values.size(), [&](YamlKeys& keys, std::size_t at) {
      if (at >= values.size()) values.resize(at + 1);
      visit(keys, values[at]);
    });
  }
  /// Refuses the file where `holds` is false. `problem` continues a sentence that begins with the key.
  void check(const char* key, bool holds, const std::string& problem, const std::string& remedy) const {
    if (const YamlMap* map = source(); map && !holds) map->fail(key, problem, remedy);
  }

  // Checks that a schema can state. Each refuses the file, like `check`.

  /// A condition on words, flags and the presence of keys. `holds` must follow from these alone.
  void needs(const char* key, bool holds, const std::string& problem, const std::string& remedy) {
    if (!holds) forbid(std::string(key) + " " + problem + ": " + remedy);
    check(key, holds, problem, remedy);
  }
  /// A list has from `min` to `max` items; `any_size`: however many.
  void check_size(const char* key, std::size_t size, std::size_t min, std::size_t max,
                  const std::string& problem, const std::string& remedy) {
    Admitted admitted;
    admitted.min_items = min;
    if (max != any_size) admitted.max_items = max;
    admit(key, admitted);
    check(key, size >= min && size <= max, problem, remedy);
  }
  /// At least one of the keys is there. `holds`: whether one is.
  void needs_any(const char* key, const std::vector<std::string>& any_of, bool holds,
                 const std::string& problem, const std::string& remedy) {
    require_any(any_of);
    check(key, holds, problem, remedy);
  }
  /// A number is at least `min`; with `zero_too` it may be zero.
  void check_min(const char* key, double value, double min, bool zero_too, const std::string& problem,
                 const std::string& remedy) {
    Admitted admitted;
    admitted.min = min;
    admitted.zero_too = zero_too;
    admit(key, admitted);
    check(key, value >= min || (zero_too && value == 0.0), problem, remedy);
  }
  /// A number is not zero.
  void check_not_zero(const char* key, double value, const std::string& problem, const std::string& remedy) {
    Admitted admitted;
    admitted.not_zero = true;
    admit(key, admitted);
    check(key, value != 0.0, problem, remedy);
  }
  /// The text has a form. `holds`: whether the present one has it.
  void check_form(const char* key, bool holds, const Admitted& form, const std::string& problem,
                  const std::string& remedy) {
    admit(key, form);
    check(key, holds, problem, remedy);
  }

  /// The value, constructed if absent.
  template <class T>
  static T& made(std::optional<T>& value) {
    return value ? *value : value.emplace();
  }

 protected:
  virtual void whole_number(const char* /*key*/, std::int64_t& /*value*/, std::int64_t /*low*/,
                            std::int64_t /*high*/, std::optional<std::int64_t> /*otherwise*/) {}
  virtual void choice(const char* /*key*/, std::size_t& /*word*/, const std::vector<std::string>& /*words*/,
                      std::optional<std::size_t> /*otherwise*/) {}
  /// Visits items 0, 1, ... of a list of maps; when writing there are `count`.
  virtual void maps(const char* /*key*/, std::size_t /*count*/, const VisitItem& /*visit*/) {}
  /// Whether required sections are visited that have no value yet.
  virtual bool visits_unset() const { return source() != nullptr; }
  /// What is known from a check of a key that was visited before.
  virtual void admit(const char* /*key*/, const Admitted& /*admitted*/) {}
  /// The words, flags and keys so far are refused.
  virtual void forbid(const std::string& /*reason*/) {}
};

/// Reads the values from a map without finish(). Throws ConfigError with remedy, file, line, key.
class YamlKeyReader : public virtual YamlKeys {
 public:
  explicit YamlKeyReader(const YamlMap& map) : map_(map) {}

  void number(const char* key, double& value, const Range& range, std::optional<double> otherwise,
              Usual usual) override;
  void numbers(const char* key, std::vector<double>& values, const Range& range) override;
  void flag(const char* key, bool& value, bool otherwise, Usual usual) override;
  void text(const char* key, std::string& value, const std::optional<std::string>& otherwise,
            Usual usual) override;
  void texts(const char* key, std::map<std::string, std::string>& values) override;
  void path(const char* key, std::filesystem::path& value) override;
  void map(const char* key, const Visit& visit) override;
  bool given(const char* key, bool is_set) override;
  bool is_map(const char* key, bool is_set) override;
  const YamlMap* source() const override { return &map_; }

 protected:
  void whole_number(const char* key, std::int64_t& value, std::int64_t low, std::int64_t high,
                    std::optional<std::int64_t> otherwise) override;
  void choice(const char* key, std::size_t& word, const std::vector<std::string>& words,
              std::optional<std::size_t> otherwise) override;
  void maps(const char* key, std::size_t count, const VisitItem& visit) override;

  YamlMap map_;
};

/// Writes the values so that they read back exactly.
class YamlKeyWriter : public virtual YamlKeys {
 public:
  /// On one line "key: value, key: value"; or a line for each, indented.
  enum class Layout : std::uint8_t { one_line, lines };
  explicit YamlKeyWriter(Layout layout, std::size_t indent = 0) : layout_(layout), indent_(indent, ' ') {}

  void number(const char* key, double& value, const Range& range, std::optional<double> otherwise,
              Usual usual) override;
  void numbers(const char* key, std::vector<double>& values, const Range& range) override;
  void flag(const char* key, bool& value, bool otherwise, Usual usual) override;
  void text(const char* key, std::string& value, const std::optional<std::string>& otherwise,
            Usual usual) override;
  void path(const char* key, std::filesystem::path& value) override;
  void map(const char* key, const Visit& visit) override;
  void section(const char* key, const Visit& visit) override;

  const std::string& written() const noexcept { return written_; }

 protected:
  void whole_number(const char* key, std::int64_t& value, std::int64_t low, std::int64_t high,
                    std::optional<std::int64_t> otherwise) override;
  void choice(const char* key, std::size_t& word, const std::vector<std::string>& words,
              std::optional<std::size_t> otherwise) override;
  void maps(const char* key, std::size_t count, const VisitItem& visit) override;
  void add(const char* key, const std::string& value);

 private:
  Layout layout_;
  std::string indent_;
  std::string written_;
};

/// "[a, b, c]", each value as `text_of` writes it.
template <class Text>
std::string list_text(const std::vector<double>& values, const Text& text_of) {
  std::string text = "[";
  for (const double value : values) text += (text.size() > 1 ? ", " : "") + text_of(value);
  return text + "]";
}

}  // namespace upright
