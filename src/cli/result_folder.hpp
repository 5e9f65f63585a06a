// The files and folders in which a command writes its results.
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

/// Throws ConfigError where the file that --out names is there, unless `force`.
void refuse_replacing(const std::filesystem::path& file, bool force);

/// The path of a plant file as `file`, a gain file that may lie elsewhere, names it.
std::string path_from(const std::filesystem::path& file, const std::filesystem::path& plant);

}  // namespace upright::cli
