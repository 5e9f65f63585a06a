// One controller per rig: whoever opens a rig on this machine first keeps it until it ends, however it ends.
#pragma once

#include <string>

namespace upright {

/// Held through a name in the kernel's abstract socket name space, which goes with its process: nothing is
/// left behind by a crash, and no folder has to be writable. Another machine is not kept out.
class RigLock {
 public:
  RigLock() = default;
  ~RigLock();
  RigLock(const RigLock&) = delete;
  RigLock& operator=(const RigLock&) = delete;

  /// `link` names the rig's link, the same for everybody who means it. Throws DeviceError when another
  /// controller has it. Does nothing when it is held already.
  void take(const std::string& link);

 private:
  int descriptor_ = -1;
};

}  // namespace upright
