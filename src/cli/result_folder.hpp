// The folder in which a command writes its results.
#pragma once

#include <filesystem>
#include <functional>
#include <ostream>
#include <string>

namespace upright::cli {

/// Creates the folder that --out names. Throws ConfigError.
void create_result_folder(const std::filesystem::path& folder);

/// Writes a file of results. Throws ConfigError where it cannot be written whole.
void write_result(const std::filesystem::path& file, const std::function<void(std::ostream&)>& write);

}  // namespace upright::cli
