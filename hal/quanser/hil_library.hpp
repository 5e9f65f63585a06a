// Quanser's libraries, loaded when a rig asks for them.
#pragma once

#include <string>

#include "hil.hpp"
#include "upright/hal/wiring.hpp"

namespace upright {

class HilLibrary {
 public:
  /// Loads the libraries that `rig` names; `rig_file` is what sentences show. Throws DeviceError with what
  /// the loader said and the remedy when libhil is not there, or is another library.
  HilLibrary(const QuanserRig& rig, const std::string& rig_file);

  const hil::Functions& functions() const noexcept { return functions_; }
  /// "4.3.1", or "unknown".
  std::string version() const;
  /// The file that was loaded.
  const std::string& path() const noexcept { return path_; }
  /// "error 108: no such board", in the library's words where it has them.
  std::string words_for(hil::Error error) const;

 private:
  hil::Functions functions_;
  std::string path_;
};

}  // namespace upright
