// The error of a plain simulation with the right model, caused by noise alone.
#pragma once

#include "fit.hpp"

namespace upright {

/// RMS error that disturbances and sensor noise cause in a plain simulation with fitted initial states, in
/// units of the sensor noise. 1 without disturbances.
struct SimulationFloor {
  double usual = 1.0;    ///< the median draw
  double highest = 1.0;  ///< the largest draw
};

/// `point` has the plant, the initial states of the segments and the noise. Disturbances are drawn from this
/// noise `draws` times with a fixed seed, and propagated along the linearised motion.
SimulationFloor simulation_floor(const FitData& data, const FitPoint& point, std::size_t draws);

}  // namespace upright
