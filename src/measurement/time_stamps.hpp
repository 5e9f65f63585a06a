// Time stamps that scatter around the clock of the measurement.
#pragma once

#include <optional>

#include "upright/measurement/measurement.hpp"

namespace upright {

struct ScatteredStamps {
  double period_s = 0.0;   ///< of the steady clock
  double scatter_s = 0.0;  ///< standard deviation of the stamps around it
};

/// Empty if the motion follows the stamps, or shows no difference.
std::optional<ScatteredStamps> find_scatter(const Measurement& run);

}  // namespace upright
