// What a run was granted of the real-time set-up of its thread, read back.
#pragma once

#include <string>

namespace upright {

struct RealtimeGrant {
  std::string policy = "SCHED_OTHER";  ///< read back from the kernel
  int priority = 0;
  bool memory_locked = false;
  int cpu = -1;      ///< -1: not pinned
  std::string note;  ///< one sentence: what was granted, or what to do to be granted it
};

}  // namespace upright
