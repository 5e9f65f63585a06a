// What a backend says of itself: its name and section in rig files, and the rig that it makes. One folder per
// backend, one line in backends.hpp; rig files, joined rigs, doctor and error messages follow from there.
#pragma once

#include <memory>
#include <string>

#include "base/yaml_keys.hpp"
#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

struct BackendKind {
  const char* name;  ///< in rig files
  /// Visits its section of a rig file in which it has a role. `rig` has been visited as far as backends,
  /// calibration, amplifier and limits. May throw ConfigError. Null: `rig_file.cpp` visits it, for any rig
  /// may have it.
  void (*keys)(YamlKeys& document, RigFile& rig);
  /// The rig, or its part that has the roles of this backend, for a loop of this period. Not open yet.
  std::unique_ptr<Rig> (*make)(const RigFile& rig, double period_s);
};

}  // namespace upright
