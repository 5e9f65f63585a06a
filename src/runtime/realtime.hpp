// Real-time settings of the loop's thread, with read-back of what was granted.
#pragma once

#include <cstdint>

#include "upright/record/realtime_settings.hpp"

namespace upright {

/// Requests SCHED_FIFO, a processor and locked memory for the calling thread, pre-faults its stack, and
/// reports what was not granted. Never fails.
RealtimeGrant enter_realtime(const RealtimeRequest& request);

/// Number of page faults of the calling thread so far.
std::uint64_t page_faults();

/// The processor that enter_realtime would choose, called from a thread that is not bound yet; -1: none.
int loop_cpu(const RealtimeRequest& request);

/// Restricts the calling thread, and threads that it starts, to other processors where there are any, and
/// lowers its priority below all work without real-time priority, so that display does not delay a run.
/// -1: no processor is reserved.
void make_way(int cpu);

}  // namespace upright
