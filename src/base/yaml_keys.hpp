// The keys of a section of a YAML file, each once: one list in the order of the file, by which a section is
// read and written. What visits the list decides which of the two.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "upright/base/yaml_reader.hpp"

namespace upright {

constexpr std::nullopt_t required = std::nullopt;  ///< in place of a default

/// Whether a text names a key whose value is its default.
enum class Usual : std::uint8_t { written, left_out };

/// The words of an enumeration, in its order.
template <std::size_t N>
using Words = std::array<const char*, N>;

/// Visits the keys of a section. A visitor overrides what it cares for. It may change what it visits: who
/// only writes gives it a copy.
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
  /// Relative to the folder of the file.
  virtual void path(const char* /*key*/, std::filesystem::path& /*value*/) {}
  /// A map of keys. In a text it stands on one line.
  virtual void map(const char* /*key*/, const Visit& /*visit*/) {}
  /// The same with a line for each of its keys in a text.
  virtual void section(const char* key, const Visit& visit) { map(key, visit); }

  /// Whether the key is there, or is to be written: then `is_set` says it.
  virtual bool given(const char* /*key*/, bool is_set) { return is_set; }
  /// Whether it holds a map, or is to.
  virtual bool is_map(const char* /*key*/, bool is_set) { return is_set; }
  /// What is being read; null where nothing is: for steps that belong to reading alone.
  virtual const YamlMap* source() const { return nullptr; }

  template <std::signed_integral Int>
  void integer(const char* key, Int& value, std::int64_t low, std::int64_t high,
               std::optional<std::int64_t> otherwise = required) {
    std::int64_t wide = value;
    whole_number(key, wide, low, high, otherwise);
    value = static_cast<Int>(wide);
  }
  /// An enumeration by its words; false and true by two.
  template <class Enum, std::size_t N>
  void one_of(const char* key, Enum& value, const Words<N>& words,
              std::optional<std::type_identity_t<Enum>> otherwise = required) {
    auto at = static_cast<std::size_t>(value);
    choice(key, at, {words.begin(), words.end()},
           otherwise ? std::optional(static_cast<std::size_t>(*otherwise)) : required);
    value = static_cast<Enum>(at);
  }
  /// An integer that may be left out.
  void optional_integer(const char* key, std::optional<int>& value, std::int64_t low, std::int64_t high) {
    if (given(key, value.has_value())) integer(key, made(value), low, high);
  }
  /// A map that may be left out. `visit` takes the visitor and the value.
  template <class T, class VisitValue>
  void optional_map(const char* key, std::optional<T>& value, const VisitValue& visit) {
    if (given(key, value.has_value())) map(key, [&](YamlKeys& keys) { visit(keys, made(value)); });
  }
  /// A map that may be left out of a file and is always written.
  void usual_map(const char* key, const Visit& visit) {
    if (given(key, true)) map(key, visit);
  }
  /// A section that must be there to be read, and is written where it is set.
  template <class T, class VisitValue>
  void section_of(const char* key, std::optional<T>& value, const VisitValue& visit) {
    if (source() || value) section(key, [&](YamlKeys& keys) { visit(keys, made(value)); });
  }
  /// A list of maps.
  template <class T, class VisitValue>
  void items(const char* key, std::vector<T>& values, const VisitValue& visit) {
    maps(key, values.size(), [&](YamlKeys& keys, std::size_t at) {
      if (at >= values.size()) values.resize(at + 1);
      visit(keys, values[at]);
    });
  }
  /// Refuses the file where `holds` is false. `problem` goes on from the key.
  void check(const char* key, bool holds, const std::string& problem, const std::string& remedy) const {
    if (const YamlMap* map = source(); map && !holds) map->fail(key, problem, remedy);
  }

  /// The value, made where there is none.
  template <class T>
  static T& made(std::optional<T>& value) {
    return value ? *value : value.emplace();
  }

 protected:
  virtual void whole_number(const char* /*key*/, std::int64_t& /*value*/, std::int64_t /*low*/,
                            std::int64_t /*high*/, std::optional<std::int64_t> /*otherwise*/) {}
  virtual void choice(const char* /*key*/, std::size_t& /*word*/, const std::vector<std::string>& /*words*/,
                      std::optional<std::size_t> /*otherwise*/) {}
  /// Visits item 0, 1, ... of a list of maps; `count` of them are to be written.
  virtual void maps(const char* /*key*/, std::size_t /*count*/, const VisitItem& /*visit*/) {}
};

/// Sets the values from a map, which it does not finish. Throws ConfigError with remedy, file, line and key.
class YamlKeyReader : public virtual YamlKeys {
 public:
  explicit YamlKeyReader(const YamlMap& map) : map_(map) {}

  void number(const char* key, double& value, const Range& range, std::optional<double> otherwise,
              Usual usual) override;
  void numbers(const char* key, std::vector<double>& values, const Range& range) override;
  void flag(const char* key, bool& value, bool otherwise, Usual usual) override;
  void text(const char* key, std::string& value, const std::optional<std::string>& otherwise,
            Usual usual) override;
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
