// The real-time settings that a run requests for its thread, and those that it was granted, as read back.
#pragma once

#include <optional>
#include <string>

namespace upright {

/// What is asked of the kernel.
struct RealtimeRequest {
  int priority = 80;  ///< of SCHED_FIFO
  int cpu = -1;       ///< processor for the thread; -1: the last one allowed, when there are several
  std::optional<double> spin_us;  ///< replaces the rig file's spin_us
};

/// What the kernel granted to the loop's thread.
struct RealtimeGrant {
  std::string policy = "SCHED_OTHER";  ///< read back from the kernel
  int priority = 0;                    ///< of the policy
  bool memory_locked = false;          ///< no page fault can delay it
  int cpu = -1;                        ///< -1: not pinned
  std::string note;                    ///< one sentence: the granted settings, or the remedy
};

}  // namespace upright
