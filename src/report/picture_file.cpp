#include "picture_file.hpp"

#include <fstream>

#include "upright/base/error.hpp"

namespace upright {

void save_picture(const Plot& plot, const std::filesystem::path& file) {
  std::ofstream out(file);
  out << svg_file_of(plot);
  out.close();
  if (!out)
    throw ConfigError("cannot write " + file.string() +
                      ": free some disk space or choose another folder with --out");
}

}  // namespace upright
