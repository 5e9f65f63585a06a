// Time stamps that scatter about the clock by which the rows were really measured.
#pragma once

#include <optional>

#include "upright/measurement/measurement.hpp"

namespace upright {

struct ScatteredStamps {
  double period_s = 0.0;   ///< between rows, of the steady clock
  double scatter_s = 0.0;  ///< standard deviation of the stamps about it
};

/// Nothing where the motion follows the stamps, or tells no difference.
std::optional<ScatteredStamps> find_scatter(const Measurement& run);

}  // namespace upright
