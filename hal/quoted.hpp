// Texts as rig files hold them.
#pragma once

#include <string>

namespace upright {

/// A text in double quotes, as YAML reads it back.
inline std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + "\"";
}

}  // namespace upright
