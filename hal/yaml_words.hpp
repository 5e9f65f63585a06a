// What the sections of a rig file have in common: enumerations as words, small integers.
#pragma once

#include <algorithm>
#include <array>
#include <string>

#include "upright/base/yaml_reader.hpp"

namespace upright {

/// The words of an enumeration, in its order.
template <std::size_t N>
using Words = std::array<const char*, N>;

template <class Enum, std::size_t N>
Enum choose(const YamlMap& map, const std::string& key, const Words<N>& words) {
  const std::string word = map.choice(key, {words.begin(), words.end()});
  return static_cast<Enum>(std::find(words.begin(), words.end(), word) - words.begin());
}

inline int small_integer(const YamlMap& map, const std::string& key, int low, int high) {
  return static_cast<int>(map.integer(key, low, high));
}

template <class Enum, std::size_t N>
std::string word_of(Enum value, const Words<N>& words) {
  return words[static_cast<std::size_t>(value)];
}

}  // namespace upright
