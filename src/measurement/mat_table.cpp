#include "mat_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mat_file.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

/// All vectors of a table have one value for each row.
void refuse_lengths(const std::filesystem::path& file, const std::vector<std::string>& names,
                    const std::vector<std::vector<double>>& columns) {
  for (std::size_t i = 1; i < columns.size(); ++i)
    if (columns[i].size() != columns[0].size())
      throw ConfigError(file.string() + ": " + names[i] + " has " + std::to_string(columns[i].size()) +
                        " values, but " + names[0] + " has " + std::to_string(columns[0].size()) +
                        ": save signals with the same time vector");
}

}  // namespace

void read_mat(const std::filesystem::path& file, const std::vector<std::string>& wanted, const CsvHead& head,
              const CsvSink& sink) {
  const MatFile mat(file);
  CsvTable table;
  table.place.resize(wanted.size());
  table.units.resize(wanted.size());
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (wanted[i].empty()) continue;
    std::vector<double> values = mat.values(wanted[i]);
    if (values.empty()) continue;
    table.place[i] = columns.size();
    names.push_back(wanted[i]);
    columns.push_back(std::move(values));
  }
  // For a message only, and it takes reading the whole file.
  if (columns.size() < wanted.size())
    for (const MatVector& vector : mat.vectors()) table.names.push_back(vector.path);
  head(table);
  refuse_lengths(file, names, columns);
  std::vector<double> row(columns.size());
  for (std::size_t k = 0; !columns.empty() && k < columns[0].size(); ++k) {
    for (std::size_t c = 0; c < columns.size(); ++c)
      row[c] = std::isfinite(columns[c][k]) ? columns[c][k] : std::numeric_limits<double>::quiet_NaN();
    sink({k + 1, row});
  }
}

}  // namespace upright
