// A run from its first file to its last: run directory, log, loop thread, outcome.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>

#include "upright/hal/clock.hpp"
#include "upright/hal/rig.hpp"
#include "upright/record/run_directory.hpp"
#include "upright/runtime/control_loop.hpp"
#include "upright/runtime/realtime.hpp"
#include "upright/runtime/zero_volts.hpp"

namespace upright {

/// The default of LoopLimits::most_periods_late: so many periods as make 50 ms, at least 3. Well above the
/// hiccups of a kernel without real-time scheduling, well below the time in which the pendulum falls.
std::uint64_t default_periods_late(double period_s);

/// Throws ConfigError where the loop would spend more of each period awake than it may.
void require_spin_fits(double spin_us, double period_s);

/// What a rig file limits of a run: track, coast, fall, watchdog, and what the watch on the encoders assumes
/// (the file's section `encoder_watch`, and what a plant of the rig implies where one is known; the widest of
/// both); and whether somebody checked its signs. `periods`, `most_periods_late` and `delay_exceeded` are
/// left to the caller.
LoopLimits rig_limits(const RigFile& rig, const std::optional<Plant>& plant);

struct SessionOptions {
  std::filesystem::path out = "runs";  ///< the folder that run directories go to
  RealtimeRequest realtime;            ///< not asked for in virtual time
  ModelParts parts;
  std::size_t log_queue_rows = RunLog::Options{}.queue_rows;
  CommandSource* source = nullptr;  ///< null: balance. It must outlive the session.
  RowWatcher* watcher = nullptr;    ///< of the log's rows; null: nobody. It must outlive the session.
  /// Called about five times per second from the calling thread while the loop runs; may be empty.
  std::function<void(const LiveStatus&)> show;
  StopWatcher stop;  ///< of what comes after the loop: zero volts is waited for
};

struct SessionResult {
  std::filesystem::path directory;  ///< where it is at the end
  std::filesystem::path made_at;    ///< elsewhere: another program moved it while the run went on
  LoopOutcome outcome;
  LogSummary log;
  RealtimeGrant scheduling;
  bool outcome_written = false;
  double elapsed_s = 0.0;  ///< of the machine's time
};

/// Makes zero counts of a calibration that takes its zero at the start: reads the rig until it has fresh
/// counts. The rig is open. Throws DeviceError when there are none within `patience_s`.
void find_zero(Rig& rig, Clock& clock, RigFile& file, double patience_s);

/// Runs the loop of `setup` on a rig that is open, and leaves a complete run directory. When this returns the
/// rig was stopped and the outcome's `stop` says what is known of it. When it throws the rig was stopped too;
/// what is thrown is a DeviceError where zero volts could not be confirmed.
SessionResult run_session(RunSetup setup, Rig& rig, Clock& clock, const SignalFlag& signal,
                          SessionOptions options);

}  // namespace upright
