// How work that takes long says how far it is.
#pragma once

#include <functional>
#include <string>

namespace upright {

/// Called with the share of the work that is done (0 to 1; NaN: not known) and what is being done. It may be
/// called by any thread, one at a time, and must not hold up the caller. Empty: nobody listens.
using ProgressCallback = std::function<void(double share, const std::string& what)>;

}  // namespace upright
