// What `upright check` finds in one file, for other commands.
#pragma once

#include <string>

namespace upright::cli {

/// What is wrong with a file of any kind, as one sentence; empty: nothing.
std::string fault_of_file(const std::string& file);

}  // namespace upright::cli
