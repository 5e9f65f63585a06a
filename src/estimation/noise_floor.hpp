// How far a plain simulation of a right model would be from the measurement, for the noise alone.
#pragma once

#include "upright/estimation/fit.hpp"

namespace upright {

/// Root mean square of what disturbances and sensors make of a plain simulation with fitted initial states,
/// in units of the sensors' noise: 1 without disturbances.
struct SimulationFloor {
  double usual = 1.0;    ///< in the middle of all draws
  double highest = 1.0;  ///< the largest draw
};

/// `point` holds the plant, starts for the segments and the noise; disturbances are drawn from it (always the
/// same ones), `draws` times, and carried along the linearised motion.
SimulationFloor simulation_floor(const FitData& data, const FitPoint& point, std::size_t draws);

}  // namespace upright
