// What reports read from result files, and how they write it.
#pragma once

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <memory>
#include <sstream>
#include <string>

#include "base/input_file.hpp"
#include "base/number_text.hpp"

namespace upright {

/// How runs of a sweep and trials of an experiment end.
inline const std::array<std::string, 3> outcome_names = {"stable", "oscillating", "fell"};

/// Throws ConfigError if the file cannot be read.
inline std::string file_text(const std::filesystem::path& file) {
  std::ostringstream text;
  text << InputFile(file).rdbuf();
  return text.str();
}

/// Empty if there is no such file.
inline std::string file_text_if_there(const std::filesystem::path& file) {
  std::ostringstream text;
  if (const auto in = InputFile::if_there(file)) text << in->rdbuf();
  return text.str();
}

/// The number in a cell of a table; NaN for an empty cell.
inline double cell_number(const std::string& cell) {
  return cell.empty() ? std::numeric_limits<double>::quiet_NaN() : std::strtod(cell.c_str(), nullptr);
}

/// A time in milliseconds, without the unit; a dash for "never".
inline std::string milliseconds(double seconds) {
  return std::isfinite(seconds) ? number_text(1e3 * seconds, 4) : "-";
}

}  // namespace upright
