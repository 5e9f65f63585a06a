// Where a search for a mass with a motion of its own on the cart (attached_mass.hpp) begins, and how far its
// parameters may go.
#pragma once

#include <vector>

#include "candidates.hpp"

namespace upright {

/// Limits the parameters of an effect that attaches a mass to what these runs can show: its vibration is
/// sampled, and is not slower than the runs.
void limit_attached_mass(std::size_t effect, const DataRange& range, const PriorPolicy& prior,
                         std::vector<FreeParameter>& free);

/// Parameter values from which to search for it.
std::vector<std::vector<double>> attached_mass_starts(std::size_t effect, const DataRange& range,
                                                      const PriorPolicy& prior);

}  // namespace upright
