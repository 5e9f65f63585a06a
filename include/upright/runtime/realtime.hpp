// Real-time set-up of the thread that runs the loop, and what was granted of it, read back.
#pragma once

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

}  // namespace upright
