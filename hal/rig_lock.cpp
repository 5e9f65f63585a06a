#include "rig_lock.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <functional>

#include "upright/base/error.hpp"

namespace upright {

RigLock::~RigLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void RigLock::take(const std::string& link) {
  if (descriptor_ >= 0) return;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  // The name begins after a zero, which makes it abstract. A long one is told apart by its hash.
  std::string name = "upright-rig " + link;
  constexpr std::size_t room = sizeof address.sun_path - 1;
  if (name.size() > room) name = "upright-rig #" + std::to_string(std::hash<std::string>{}(link));
  std::copy(name.begin(), name.end(), address.sun_path + 1);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  const int descriptor = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) throw DeviceError("no socket can be opened: raise the limit on open files (ulimit -n)");
  if (::bind(descriptor, reinterpret_cast<const sockaddr*>(&address), size) != 0) {
    const int problem = errno;
    ::close(descriptor);
    if (problem == EADDRINUSE)
      throw DeviceError("the rig at " + link +
                        " already has a controller on this machine: end the other program first");
    throw DeviceError("the rig at " + link + " cannot be reserved (" + std::strerror(problem) +
                      "): check the resource limits of this computer");
  }
  descriptor_ = descriptor;
}

}  // namespace upright
