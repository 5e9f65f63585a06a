#include "result_folder.hpp"

#include <fstream>

#include "upright/base/error.hpp"

namespace upright::cli {

namespace fs = std::filesystem;

void create_result_folder(const fs::path& folder) {
  std::error_code problem;
  fs::create_directories(folder, problem);
  if (problem)
    throw ConfigError("cannot create " + folder.string() + " (" + problem.message() +
                      "): choose another folder with --out");
}

void write_result(const fs::path& file, const std::function<void(std::ostream&)>& write) {
  std::ofstream out(file);
  write(out);
  out.close();
  if (!out)
    throw ConfigError("cannot write " + file.string() +
                      ": free some space, or choose another folder with --out");
}

void refuse_replacing(const fs::path& file, bool force) {
  if (fs::exists(file) && !force)
    throw ConfigError(file.string() +
                      " already exists: choose another file with --out, or replace it with --force");
}

std::string path_from(const fs::path& file, const fs::path& plant) {
  std::error_code error;
  const fs::path folder = fs::absolute(file).parent_path();
  const fs::path relative = fs::relative(plant, folder, error);
  return error || relative.empty() ? fs::absolute(plant).string() : relative.string();
}

}  // namespace upright::cli
