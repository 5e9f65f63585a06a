// Wake-up latency of a thread that sleeps as the loop does: absolute times, same rate and priority.
#pragma once

#include <string>

#include "finding.hpp"
#include "runtime/realtime.hpp"
#include "upright/record/timing_stats.hpp"

namespace upright {

struct WakeProbe {
  DurationHistogram late;
  RealtimeGrant grant;
};

/// Sleeps for `duration_s` at `rate_hz` in a separate thread, and polls as `request` says. `loaded`:
/// meanwhile one thread per processor, without real-time priority, loads memory and system calls.
WakeProbe probe_wake_ups(double rate_hz, double duration_s, bool loaded, const RealtimeRequest& request);

/// Good if 99.9 % of the wake-ups are within a tenth of the period; bad if they are not within half of
/// it.
Finding judge_wake_ups(const std::string& subject, const DurationHistogram& late, double period_s);

}  // namespace upright
