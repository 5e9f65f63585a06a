// The run directory (interface: "Run directory"): made before anything moves, completed when the run is over.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/plant.hpp"
#include "upright/runtime/control_loop.hpp"
#include "upright/runtime/realtime.hpp"

namespace upright {

/// The whole resolved configuration of a run.
struct RunSetup {
  std::string command;  ///< as it was typed
  std::string label;
  double duration_s = 0.0;
  bool fast = false;
  std::uint64_t seed = 0;
  std::optional<double> theta0_rad;
  ControlConfig control;
  RigFile rig;  ///< its calibration with the zero already known
  std::optional<Plant> plant;
  LoopLimits limits;
  RealtimeGrant scheduling;
  std::string experiment_text;  ///< the section `experiment` of run.yaml; empty: none
};

/// What the log made of the rows it was given.
struct LogSummary {
  std::uint64_t rows_written = 0;
  std::uint64_t rows_dropped = 0;
  std::string failure;  ///< empty, or why it ended early
};

/// "completed", "fell" or "stopped".
const char* result_of(const LoopOutcome& outcome) noexcept;

class RunDirectory {
 public:
  /// Makes `parent`/<UTC now>-<label>, with a number behind it when that is taken. Throws ConfigError when it
  /// cannot be made, or when the label is not made of letters, digits, '.', '_' and '-'.
  RunDirectory(const std::filesystem::path& parent, const std::string& label);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path samples() const { return path_ / "samples.csv"; }

  /// Writes run.yaml, and reserves the room that its completed version will take, so that a disk that fills
  /// up during the run does not lose the outcome. Throws ConfigError.
  void write_start(const RunSetup& setup);

  /// Puts the completed run.yaml in the place of the first. False: it could not be written, the first one
  /// stays.
  bool write_outcome(const LoopOutcome& outcome, const LoopLimits& limits, const LogSummary& log) noexcept;

 private:
  std::filesystem::path path_;
  std::string started_utc_;
  std::string start_text_;
};

}  // namespace upright
