// How late a thread wakes that sleeps as the loop does: at absolute times, at the loop's rate and priority.
#pragma once

#include <string>

#include "finding.hpp"
#include "upright/record/timing_stats.hpp"
#include "upright/runtime/realtime.hpp"

namespace upright {

struct WakeProbe {
  DurationHistogram late;
  RealtimeGrant grant;
};

/// Sleeps for `duration_s` at `rate_hz` in a thread of its own, and spins as `request` says. `loaded`:
/// meanwhile a thread per processor, without priority, keeps the machine busy with memory and system calls.
WakeProbe probe_wake_ups(double rate_hz, double duration_s, bool loaded, const RealtimeRequest& request);

/// Good while 99.9 % of the wake-ups are within a tenth of the period; bad when they are not within half of
/// it.
Finding judge_wake_ups(const std::string& subject, const DurationHistogram& late, double period_s);

}  // namespace upright
