// The real-time settings that the thread of a run was granted, as read back.
#pragma once

#include <string>

namespace upright {

/// What the kernel granted to the loop's thread.
struct RealtimeGrant {
  std::string policy = "SCHED_OTHER";  ///< read back from the kernel
  int priority = 0;                    ///< of the policy
  bool memory_locked = false;          ///< no page fault can delay it
  int cpu = -1;                        ///< -1: not pinned
  std::string note;                    ///< one sentence: the granted settings, or the remedy
};

}  // namespace upright
