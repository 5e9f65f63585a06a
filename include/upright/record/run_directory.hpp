// Run directories (docs/reference/run-directory.md): created before any motion, completed after the run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "upright/control/gain_file.hpp"
#include "upright/hal/rig_file.hpp"
#include "upright/model/plant.hpp"
#include "upright/record/loop_outcome.hpp"
#include "upright/record/realtime_settings.hpp"

namespace upright {

/// The complete configuration of a run, with all defaults filled in.
struct RunSetup {
  std::string command;               ///< the command line
  std::string label;                 ///< last part of the name of the run directory
  double duration_s = 0.0;           ///< of a complete run [s]
  bool fast = false;                 ///< in virtual time
  std::uint64_t seed = 0;            ///< of a simulated rig's noise
  std::optional<double> theta0_rad;  ///< replaces the simulated rig's initial angle [rad]
  ControlConfig control;             ///< the gain file
  RigFile rig;                       ///< with the zero of its calibration known
  std::optional<Plant> plant;        ///< of a simulated rig
  LoopLimits limits;                 ///< where the loop stops
  DeviceFacts device;                ///< identification of the rig's device
  RealtimeGrant scheduling;          ///< what the kernel granted
  std::string experiment_text;       ///< the section `experiment` of run.yaml; empty: none
};

/// What the log has written.
struct LogSummary {
  std::uint64_t rows_written = 0;  ///< rows on the disk
  std::uint64_t rows_dropped = 0;  ///< rows for which the queue had no room
  std::string failure;             ///< empty, or why the log ended early
};

/// "completed", "fell" or "stopped".
const char* result_of(const LoopOutcome& outcome) noexcept;

/// `sentence_of` the outcome, or of the log's failure where that ended the run.
std::string sentence_of(const LoopOutcome& outcome, const LoopLimits& limits, const LogSummary& log);

/// A run directory while its run goes on.
class RunDirectory {
 public:
  /// Creates a folder in `parent`, named by the time in UTC and the label, with a number appended when it
  /// exists. Throws ConfigError when that fails, or when the label contains anything but letters, digits,
  /// '.', '_' and '-'.
  RunDirectory(const std::filesystem::path& parent, const std::string& label);

  ~RunDirectory();
  RunDirectory(const RunDirectory&) = delete;
  RunDirectory& operator=(const RunDirectory&) = delete;

  /// Path at creation.
  const std::filesystem::path& path() const { return path_; }
  /// Present path: another program may have moved the directory. Empty: it was removed.
  std::filesystem::path path_now() const;
  std::filesystem::path samples() const { return path_ / "samples.csv"; }  ///< the file of the rows

  /// Writes run.yaml and reserves the space of its completed version, so that the outcome is not lost
  /// when the disk fills up during the run. Throws ConfigError.
  void write_start(const RunSetup& setup);

  /// Replaces run.yaml by its completed version, wherever the directory is now. False: it could not be
  /// written, and the first version remains.
  bool write_outcome(const LoopOutcome& outcome, const LoopLimits& limits, const LogSummary& log) noexcept;

 private:
  void hold();

  std::filesystem::path path_;
  int descriptor_ = -1;  ///< of the directory: valid even if it is moved
  std::string started_utc_;
  std::string start_text_;
};

}  // namespace upright
