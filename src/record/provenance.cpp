#include "provenance.hpp"

#include <sys/utsname.h>

#include "build_info.hpp"

namespace upright {

Provenance provenance() {
  Provenance result;
  result.version = build_info::version;
  result.git_commit = build_info::git_commit;
  result.git_dirty = build_info::git_dirty;
  result.compiler = __VERSION__;
  utsname system{};
  if (uname(&system) == 0) {
    result.host = system.nodename;
    result.kernel = std::string(system.sysname) + " " + system.release + " " + system.version;
    result.machine = system.machine;
  }
  return result;
}

}  // namespace upright
