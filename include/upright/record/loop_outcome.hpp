// Limits of a run, its outcome, and sentences that describe it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "upright/control/encoder_assumptions.hpp"
#include "upright/hal/rig.hpp"
#include "upright/record/link_counts.hpp"
#include "upright/record/timing_stats.hpp"

namespace upright {

/// Why a run ended. All but `duration` are safety stops, which are latched: the loop does not continue.
enum class StopReason : std::uint8_t {
  duration,  ///< the requested time is over
  signal,
  stop_button,  ///< stop button of the live page
  not_finite,
  stale_encoder,
  stuck_encoder,  ///< fresh counts that do not follow the motion
  link_lost,
  rig_fault,
  track_limit,
  fell,
  overrun,
  emergency_stop,
  log_failed,
  not_ready,  ///< an experiment did not reach its start position
};

/// "duration", "signal", "not_finite", ...
const char* name_of(StopReason reason) noexcept;

/// Where the loop stops.
struct LoopLimits {
  std::uint64_t periods = 0;    ///< rows of a complete run
  double track_limit_m = 0.0;   ///< stop where |x| reaches it
  double fall_angle_rad = 0.0;  ///< stop where |theta| reaches it
  /// Stop when there was no fresh reading, or no successful write, for longer than this.
  double watchdog_s = 0.0;
  /// Stop when more consecutive periods than this ended late or were missed.
  std::uint64_t max_periods_late = 0;
  /// Without voltage, a cart coasts for this many seconds times its velocity.
  double coast_s = 0.0;
  std::int64_t spin_ns = 0;          ///< final part of each wait in which the loop polls the clock
  EncoderAssumptions encoders = {};  ///< assumptions of the encoder watch
  // Known beforehand, as a possible cause of a stop: for sentence_of.
  bool delay_exceeded = false;  ///< the loop's delay exceeds the delay margin of its gains
  bool signs_unproven = false;  ///< a real rig whose signs have not been checked
};

/// What happened how often.
struct LoopCounts {
  std::uint64_t periods = 0;           ///< cycles that were run
  std::uint64_t fresh = 0;             ///< readings with new counts
  std::uint64_t stale = 0;             ///< readings without new counts
  std::uint64_t faults = 0;            ///< readings that failed
  std::uint64_t missed = 0;            ///< periods without a cycle
  std::uint64_t overruns_wake = 0;     ///< cycles that ended late because the loop woke late
  std::uint64_t overruns_read = 0;     ///< the same because of reading
  std::uint64_t overruns_compute = 0;  ///< the same because of the control step
  std::uint64_t overruns_write = 0;    ///< the same because of writing
  std::uint64_t saturated = 0;         ///< cycles at the voltage limit
  std::uint64_t writes_failed = 0;     ///< cycles in which the rig did not take the voltage
  std::uint64_t page_faults = 0;  ///< of the loop's thread; zero with locked memory; counted by the session
  LinkCounts link;                ///< why readings were stale or faults
};

/// Calls see(name, count) for each count except those of the link, as in run.yaml and --json.
template <class See>
void for_each_count(const LoopCounts& c, See&& see) {
  see("periods", c.periods);
  see("fresh", c.fresh);
  see("stale", c.stale);
  see("faults", c.faults);
  see("missed", c.missed);
  see("overruns_wake", c.overruns_wake);
  see("overruns_read", c.overruns_read);
  see("overruns_compute", c.overruns_compute);
  see("overruns_write", c.overruns_write);
  see("saturated", c.saturated);
  see("writes_failed", c.writes_failed);
  see("page_faults", c.page_faults);
}

/// How a run ended.
struct LoopOutcome {
  StopReason reason = StopReason::duration;  ///< why it ended
  RigFault fault = RigFault::none;           ///< cause of a stop by the rig or the link
  int exception = 0;                         ///< exception code of the device that caused the fault
  StuckEncoder stuck = StuckEncoder::none;   ///< cause of a stop by a stuck encoder
  int signal = 0;                            ///< number of the signal; 0: none
  bool realtime = false;                     ///< the loop had SCHED_FIFO
  std::int64_t start_ns = 0;                 ///< on the loop's clock: time zero of the samples
  std::uint64_t tick = 0;                    ///< cycle in which the run ended
  std::uint64_t first_bad_tick = 0;          ///< first cycle with the fault that ended the run
  double time_s = 0.0;                       ///< at the end of the run
  double worst_theta_rad = 0.0;              ///< largest |theta|
  double worst_cart_m = 0.0;                 ///< largest |x|
  double last_theta_rad = 0.0;               ///< angle of the last cycle
  double last_cart_m = 0.0;                  ///< cart position of the last cycle
  StopReport stop;                           ///< whether the motor is known to be at zero volts
  LoopCounts counts;                         ///< what happened how often
  std::optional<DeviceTiming> device_clock;  ///< none: the computer was the clock
  DurationHistogram wake_late;               ///< lateness of the wake-ups
  DurationHistogram read;                    ///< duration of reading
  DurationHistogram compute;                 ///< duration of the control step
  DurationHistogram write;                   ///< duration of writing
  DurationHistogram cycle;                   ///< duration of the whole cycle
};

/// Calls see(name, histogram) for each part of a cycle.
template <class See>
void for_each_timing(const LoopOutcome& o, See&& see) {
  see("wake_late", o.wake_late);
  see("read", o.read);
  see("compute", o.compute);
  see("write", o.write);
  see("cycle", o.cycle);
}

/// One sentence: the cause of the end with its first bad cycle, then the remedy.
std::string sentence_of(const LoopOutcome& outcome, const LoopLimits& limits);

}  // namespace upright
