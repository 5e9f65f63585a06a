// Runs gnuplot on a script.
#pragma once

#include <string>

namespace upright {

/// The standard output of gnuplot for `script`. Uses no files on disk. Throws Error if gnuplot is missing
/// (with the remedy) or fails (with its message).
std::string gnuplot_output(const std::string& script);

}  // namespace upright
