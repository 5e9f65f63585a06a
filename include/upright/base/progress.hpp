// Progress reports of long computations.
#pragma once

#include <functional>
#include <string>

namespace upright {

/// Receives the completed share of the work (0 to 1; NaN: unknown) and the current activity. Calls may
/// come from any thread, one at a time. The function must return quickly. Empty: no reports.
using ProgressCallback = std::function<void(double share, const std::string& what)>;

}  // namespace upright
