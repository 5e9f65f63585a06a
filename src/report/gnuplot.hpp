// Runs gnuplot on a script.
#pragma once

#include <string>

namespace upright {

/// What gnuplot writes to its standard output for `script`. Nothing touches the disk. Throws Error with the
/// remedy when gnuplot is missing, or with its first complaint when it fails.
std::string gnuplot_output(const std::string& script);

}  // namespace upright
