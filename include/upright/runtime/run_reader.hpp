// Reads run directories back, also those of runs that were killed: a cut last line and a missing outcome are
// normal.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/plant.hpp"
#include "upright/model/yaml_reader.hpp"
#include "upright/runtime/log_record.hpp"

namespace upright {

/// The rows of a samples.csv.
struct Samples {
  std::vector<LogRecord> rows;  ///< `time_ns` to the nanosecond
  bool truncated = false;       ///< the last line was cut; it is not among the rows
};

/// Throws ConfigError with file and line for a column that is missing and for a line that is not a row, other
/// than at the end of the file.
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

}  // namespace upright
