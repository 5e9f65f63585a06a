// What to type to make this machine suitable for a real-time loop.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "finding.hpp"

namespace upright {

/// Lines for a shell of root, each problem's cause as a comment before its commands. `findings`: of
/// examine_machine. `user`: who will run the loop. `root`: of the files, "/" except in tests.
std::vector<std::string> commands_to_fix(const std::vector<Finding>& findings, const std::string& user,
                                         const std::filesystem::path& root = "/");

}  // namespace upright
