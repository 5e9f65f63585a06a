#include "sweep_rows.hpp"

#include <algorithm>
#include <sstream>

#include "base/input_file.hpp"
#include "upright/base/error.hpp"

namespace upright {

std::vector<SweepRow> read_sweep_rows(const std::filesystem::path& file, const std::string& header) {
  InputFile in(file);
  std::string line;
  if (!std::getline(in, line) || line != header)
    throw ConfigError(file.string() + " does not begin with the header " + header +
                      ": give a folder that `upright sweep` finished");
  const auto columns = static_cast<std::size_t>(std::count(header.begin(), header.end(), ',')) + 1;
  std::vector<SweepRow> rows;
  while (std::getline(in, line)) {
    SweepRow row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    if (row.size() != columns)
      throw ConfigError(file.string() + ":" + std::to_string(rows.size() + 2) + ": the row does not have " +
                        std::to_string(columns) + " columns: repeat the sweep");
    rows.push_back(row);
  }
  return rows;
}

}  // namespace upright
