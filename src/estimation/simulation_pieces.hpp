// The pieces into which a record is cut for simulation.
#pragma once

#include <vector>

#include "simulation.hpp"

namespace upright {

/// The pieces of run number `number`, without common samples. A rest that is shorter than the samples for its
/// initial state is left out.
std::vector<Segment> simulation_pieces(const Measurement& run, std::size_t number, const Plant& plant,
                                       const SimulationOptions& options);

}  // namespace upright
