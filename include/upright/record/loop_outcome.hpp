// What a run may do, how it ended, and the words for it.
#pragma once

#include <cstdint>
#include <string>

#include "upright/control/encoder_watch.hpp"
#include "upright/hal/rig.hpp"
#include "upright/record/link_counts.hpp"
#include "upright/record/timing_stats.hpp"

namespace upright {

/// Why a run ended. Everything but `duration` is a safety stop, which is latched: the loop does not go on.
enum class StopReason : std::uint8_t {
  duration,  ///< the asked-for time is over
  signal,
  stop_button,  ///< of the live page
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
  not_ready,  ///< an experiment did not come to where it starts
};

/// "duration", "signal", "not_finite", ...
const char* name_of(StopReason reason) noexcept;

struct LoopLimits {
  std::uint64_t periods = 0;    ///< rows of a complete run
  double track_limit_m = 0.0;   ///< stop where |x| reaches it
  double fall_angle_rad = 0.0;  ///< stop where |theta| reaches it
  /// Stop when there was no fresh reading, or no good write, for longer than this.
  double watchdog_s = 0.0;
  /// Stop when more periods than this in a row ended late or were missed.
  std::uint64_t most_periods_late = 0;
  /// A cart without voltage rolls on for so many seconds times its velocity.
  double coast_s = 0.0;
  std::int64_t spin_ns = 0;          ///< of each wait, at its end, spent awake
  EncoderAssumptions encoders = {};  ///< of the watch on the encoders
  // What is known beforehand and may be why it ends: for sentence_of.
  bool delay_exceeded = false;  ///< the plant does not bear the loop's delay, or its gains
  bool signs_unproven = false;  ///< a real rig whose signs nobody checked
};

struct LoopCounts {
  std::uint64_t periods = 0;  ///< cycles that ran
  std::uint64_t fresh = 0, stale = 0, faults = 0;
  std::uint64_t missed = 0;  ///< periods that passed without a cycle
  std::uint64_t overruns_wake = 0, overruns_read = 0, overruns_compute = 0, overruns_write = 0;
  std::uint64_t saturated = 0, writes_failed = 0;
  std::uint64_t page_faults = 0;  ///< of the loop's thread, none with memory locked; the session counts them
  LinkCounts link;                ///< why readings were stale or faults
};

/// Calls see(name, count) for every count but those of the link, as run.yaml and --json list them.
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

struct LoopOutcome {
  StopReason reason = StopReason::duration;
  RigFault fault = RigFault::none;          ///< behind a stop by the rig or the link
  int exception = 0;                        ///< behind that fault: the number the device answered with
  StuckEncoder stuck = StuckEncoder::none;  ///< behind a stop by a stuck encoder
  int signal = 0;
  bool realtime = false;             ///< the loop was granted SCHED_FIFO
  std::int64_t start_ns = 0;         ///< on the loop's clock: time zero of the samples
  std::uint64_t tick = 0;            ///< cycle in which the run ended
  std::uint64_t first_bad_tick = 0;  ///< of the trouble that ended it
  double time_s = 0.0;               ///< at the end
  double worst_theta_rad = 0.0;      ///< largest |theta|
  double worst_cart_m = 0.0;         ///< largest |x|
  double last_theta_rad = 0.0, last_cart_m = 0.0;
  StopReport stop;  ///< whether the motor is known to be at zero volts
  LoopCounts counts;
  DurationHistogram wake_late, read, compute, write, cycle;
};

/// Calls see(name, histogram) for every part of a cycle.
template <class See>
void for_each_timing(const LoopOutcome& o, See&& see) {
  see("wake_late", o.wake_late);
  see("read", o.read);
  see("compute", o.compute);
  see("write", o.write);
  see("cycle", o.cycle);
}

/// One sentence: what ended the run with its first bad cycle, and then what to do.
std::string sentence_of(const LoopOutcome& outcome, const LoopLimits& limits);

}  // namespace upright
