// Where a result came from: the program and the machine.
#pragma once

#include <string>

namespace upright {

struct Provenance {
  std::string version;
  std::string git_commit;  ///< of the sources this program was built from; "unknown" outside a repository
  bool git_dirty = false;  ///< there were changes that no commit holds
  std::string compiler;
  std::string host;
  std::string kernel;
  std::string machine;
};

Provenance provenance();

}  // namespace upright
