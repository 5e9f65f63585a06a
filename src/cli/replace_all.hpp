// Replaces a word in a text wherever it stands.
#pragma once

#include <string>

namespace upright::cli {

inline void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
}

}  // namespace upright::cli
