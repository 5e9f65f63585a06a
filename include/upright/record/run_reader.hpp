// Reads run directories back, also those of runs that were killed: a cut last line and a missing outcome are
// normal.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "upright/base/yaml_reader.hpp"
#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/plant.hpp"
#include "upright/record/log_record.hpp"

namespace upright {

/// The rows of a samples.csv.
struct Samples {
  std::vector<LogRecord> rows;  ///< `time_ns` to the nanosecond
  bool truncated = false;       ///< the last line was cut; it is not among the rows
};

/// Reads a samples.csv row by row, in the same memory however long the run was.
class SampleReader {
 public:
  /// Throws ConfigError for a column that is missing.
  explicit SampleReader(const std::filesystem::path& file);
  ~SampleReader();
  SampleReader(const SampleReader&) = delete;
  SampleReader& operator=(const SampleReader&) = delete;

  /// False after the last row. Throws ConfigError with file and line for a line that is not a row, other than
  /// at the end of the file.
  bool next(LogRecord& row);
  /// After the last row: the last line was cut and was left out.
  bool truncated() const noexcept;
  /// How much of the file is read, 0 to 1.
  double share_read() const noexcept;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// All rows at once. Throws what SampleReader throws.
Samples read_samples(const std::filesystem::path& file);

struct RunRecord {
  std::filesystem::path path;
  YamlMap document;  ///< all of run.yaml
  std::string label;
  std::string started_utc;
  double duration_s = 0.0;  ///< asked for
  ControlConfig control;
  RigFile rig;
  std::optional<Plant> plant;      ///< simulated rigs only
  std::optional<YamlMap> outcome;  ///< none: the run was killed
  Samples samples;
};

/// Reads a run directory. Throws ConfigError with remedy, file, line and key.
RunRecord read_run(const std::filesystem::path& directory);

/// The same without the samples, for who reads them row by row.
RunRecord read_run_without_samples(const std::filesystem::path& directory);

}  // namespace upright
