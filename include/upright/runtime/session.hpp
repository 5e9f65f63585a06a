// A complete run: run directory, log, loop thread, outcome.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

#include "upright/control/command_source.hpp"
#include "upright/control/state_estimator.hpp"
#include "upright/hal/clock.hpp"
#include "upright/hal/rig.hpp"
#include "upright/record/log_record.hpp"
#include "upright/record/realtime_settings.hpp"
#include "upright/record/run_directory.hpp"
#include "upright/runtime/live_status.hpp"

namespace upright {

/// The default of LoopLimits::max_periods_late: the periods in 50 ms, at least 3. Far above the delays
/// of a kernel without real-time scheduling, far below the time in which the pendulum falls.
std::uint64_t default_periods_late(double period_s);

/// Throws ConfigError where the loop would poll the clock for too large a share of each period.
void require_spin_fits(double spin_us, double period_s);

/// Throws ConfigError if the gain file asks for velocities that the rig's device measures, and it does not.
void require_velocities(const ControlConfig& control, bool rig_measures_them);

/// Which bounds of the encoder watch a rig file lacks where no plant is known, in a sentence; empty: none.
std::string gap_of_encoder_watch(const RigFile& rig);

/// The limits of a run from a rig file: track, coast, fall, watchdog, the assumptions of the encoder
/// watch (what the rig's plant implies, where it is known, and the file's section `encoder_watch`), and
/// whether the signs have been checked. The caller sets `periods`, `max_periods_late` and
/// `delay_exceeded`. Throws ConfigError where the encoder watch lacks a bound.
LoopLimits rig_limits(const RigFile& rig, const std::optional<Plant>& plant);

/// What a session adds to its setup.
struct SessionOptions {
  std::filesystem::path out = "runs";                   ///< parent folder of run directories
  RealtimeRequest realtime;                             ///< ignored in virtual time
  ModelParts parts;                                     ///< of the control step (`make_model_parts`)
  std::size_t log_queue_rows = default_log_queue_rows;  ///< rows that may wait for the disk
  CommandSource* source = nullptr;                      ///< null: balance. It must outlive the session.
  RowWatcher* watcher = nullptr;  ///< of the log's rows; null: none. It must outlive the session.
  /// Called about five times per second by the calling thread while the loop runs; may be empty.
  std::function<void(const LiveStatus&)> show;
  StopWatcher stop;  ///< callbacks while the session waits for zero volts
};

/// What a session leaves.
struct SessionResult {
  std::filesystem::path directory;  ///< path at the end of the run
  std::filesystem::path made_at;    ///< path at creation; different if another program moved the directory
  LoopOutcome outcome;              ///< how the loop ended
  LogSummary log;                   ///< what was written
  RealtimeGrant scheduling;         ///< what the kernel granted
  bool outcome_written = false;     ///< false: run.yaml is that of the start
  double elapsed_s = 0.0;           ///< wall-clock time
};

/// Determines the zero counts of a calibration whose zero is the pose at the start: reads the open rig
/// until it has fresh counts. Throws DeviceError when there are none within `patience_s`.
void find_zero(Rig& rig, Clock& clock, RigFile& file, double patience_s);

/// Runs the loop of `setup` on an open rig and completes the run directory. In every case the rig has
/// been stopped on exit; `stop` of the outcome describes the state. Throws DeviceError if zero volts
/// could not be confirmed after an exception.
SessionResult run_session(RunSetup setup, Rig& rig, Clock& clock, const SignalFlag& signal,
                          SessionOptions options);

}  // namespace upright
