// Real-time set-up of the thread that runs the loop, and what was granted of it, read back.
#pragma once

#include <cstdint>
#include <string>

namespace upright {

struct RealtimeRequest {
  int priority = 80;  ///< of SCHED_FIFO
  int cpu = -1;       ///< processor to stay on; -1: the last one allowed, when there are several
};

struct RealtimeGrant {
  std::string policy = "SCHED_OTHER";  ///< read back from the kernel
  int priority = 0;
  bool memory_locked = false;
  int cpu = -1;      ///< -1: not pinned
  std::string note;  ///< one sentence: what was granted, or what to do to be granted it
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
