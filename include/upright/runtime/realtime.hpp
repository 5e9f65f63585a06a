// Real-time set-up of the thread that runs the loop, and what was granted of it, read back.
#pragma once

#include <cstdint>
#include <optional>

#include "upright/record/realtime_grant.hpp"

namespace upright {

struct RealtimeRequest {
  int priority = 80;              ///< of SCHED_FIFO
  int cpu = -1;                   ///< processor to stay on; -1: the last one allowed, when there are several
  std::optional<double> spin_us;  ///< in place of the rig file's spin_us
};

/// Asks for SCHED_FIFO, a processor and locked memory for the calling thread, touches its stack, and says
/// plainly what was not granted. Never fails.
RealtimeGrant enter_realtime(const RealtimeRequest& request);

/// Pages that the calling thread has waited for the kernel to bring in, so far.
std::uint64_t page_faults();

/// The processor that enter_realtime would stay on, asked for from a thread that is not bound yet; -1: none.
int loop_cpu(const RealtimeRequest& request);

/// Keeps the calling thread, and threads it will start, off a processor where there is another one, and
/// behind all other work without real-time priority: what merely shows a run must not delay it. -1: no
/// processor.
void make_way(int cpu);

}  // namespace upright
