// What can be typed next, for the completion of the shells.
#pragma once

#include <string>
#include <vector>

#include "command_line.hpp"

namespace upright::cli {

/// The word by which a shell asks. It is no command: its arguments are an unfinished command line.
inline constexpr const char* completing = "__complete";

/// Prints what can stand in place of the last word, a line each: the word, a tab, its meaning. `words`: from
/// `completing` on. Prints nothing where the shell should offer its files.
ExitCode complete(const CommandLine& line, const std::vector<std::string>& words);

}  // namespace upright::cli
