// MATLAB files, v4, v5 and v7.3: numeric vectors in variables, structures and cells. MATIO reads and writes
// them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace upright {

/// A real vector in a MATLAB file, or a column of a matrix: as MATLAB would address it, so `t`,
/// `log.signals(2).values`, `data(:,3)`, `runs{2}.x`.
struct MatVector {
  std::string path;
  std::size_t length = 0;
};

class MatFile {
 public:
  /// Throws ConfigError with the cause when the file cannot be read.
  explicit MatFile(const std::filesystem::path& file);
  ~MatFile();
  MatFile(const MatFile&) = delete;
  MatFile& operator=(const MatFile&) = delete;

  /// All vectors with at least two values, in the order of the file.
  std::vector<MatVector> vectors() const;
  /// Empty where there is no such vector. Throws ConfigError where there is something else: text, a complex
  /// or sparse matrix, an object such as a timeseries.
  std::vector<double> values(const std::string& path) const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Whether the file begins as MATLAB files do; v4 files, which have no signature, by their name.
bool is_mat_file(const std::filesystem::path& file);

/// Writes column vectors as a v5 file. Throws ConfigError when the file cannot be written.
void write_mat_file(const std::filesystem::path& file,
                    const std::vector<std::pair<std::string, std::vector<double>>>& vectors);

}  // namespace upright
