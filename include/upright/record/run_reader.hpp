// Reads run directories, including those of runs that were killed: a truncated last line and a missing
// outcome are accepted.
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
  std::vector<LogRecord> rows;  ///< `time_ns` with a resolution of a nanosecond
  bool truncated = false;       ///< the last line was incomplete; it is not among the rows
};

/// Reads samples.csv row by row, with constant memory.
class SampleReader {
 public:
  /// Throws ConfigError when a column is missing.
  explicit SampleReader(const std::filesystem::path& file);
  ~SampleReader();
  SampleReader(const SampleReader&) = delete;
  SampleReader& operator=(const SampleReader&) = delete;

  /// False after the last row. Throws ConfigError with file and line for an invalid row, except at the
  /// end of the file.
  bool next(LogRecord& row);
  /// After the last row: the last line was incomplete and was skipped.
  bool truncated() const noexcept;
  /// Share of the file that has been read, 0 to 1.
  double share_read() const noexcept;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Reads all rows. Throws as SampleReader does.
Samples read_samples(const std::filesystem::path& file);

/// A run directory as read.
struct RunRecord {
  std::filesystem::path path;      ///< of the directory
  YamlMap document;                ///< the complete run.yaml
  std::string label;               ///< of the run
  std::string started_utc;         ///< as in run.yaml
  double duration_s = 0.0;         ///< requested
  ControlConfig control;           ///< the gain file of the run
  RigFile rig;                     ///< the rig file of the run
  std::optional<Plant> plant;      ///< simulated rigs only
  std::optional<YamlMap> outcome;  ///< none: the run was killed
  Samples samples;                 ///< the rows
};

/// Reads a run directory. Throws ConfigError with remedy, file, line and key.
RunRecord read_run(const std::filesystem::path& directory);

/// The same without samples, for callers that read them row by row.
RunRecord read_run_without_samples(const std::filesystem::path& directory);

}  // namespace upright
