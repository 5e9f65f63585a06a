// The run directory (interface: "Run directory"): made before anything moves, completed when the run is over.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/plant.hpp"
#include "upright/record/loop_outcome.hpp"
#include "upright/record/realtime_grant.hpp"

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
  DeviceFacts device;  ///< what the rig's device says of itself
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

/// `sentence_of` the outcome, with the log's own words where the log is what ended the run.
std::string sentence_of(const LoopOutcome& outcome, const LoopLimits& limits, const LogSummary& log);

class RunDirectory {
 public:
  /// Makes `parent`/<UTC now>-<label>, with a number behind it when that is taken. Throws ConfigError when it
  /// cannot be made, or when the label is not made of letters, digits, '.', '_' and '-'.
  RunDirectory(const std::filesystem::path& parent, const std::string& label);

  ~RunDirectory();
  RunDirectory(const RunDirectory&) = delete;
  RunDirectory& operator=(const RunDirectory&) = delete;

  /// Where it was made.
  const std::filesystem::path& path() const { return path_; }
  /// Where it is now: another program may have moved it. Empty: it was removed.
  std::filesystem::path path_now() const;
  std::filesystem::path samples() const { return path_ / "samples.csv"; }

  /// Writes run.yaml, and reserves the room that its completed version will take, so that a disk that fills
  /// up during the run does not lose the outcome. Throws ConfigError.
  void write_start(const RunSetup& setup);

  /// Puts the completed run.yaml in the place of the first, wherever the directory is now. False: it could
  /// not be written, the first one stays.
  bool write_outcome(const LoopOutcome& outcome, const LoopLimits& limits, const LogSummary& log) noexcept;

 private:
  void hold();

  std::filesystem::path path_;
  int descriptor_ = -1;  ///< of the directory: leads there when it is moved
  std::string started_utc_;
  std::string start_text_;
};

}  // namespace upright
