// The largest delays for which any controller of a class can stabilise a plant's pendulum.
#pragma once

#include "upright/model/plant.hpp"

namespace upright {

struct PhysicalLimits {
  double unstable_rate_radps = 0.0;  ///< of the falling pendulum: sqrt(m g l / J), the pivot held
  double plant_pole_radps = 0.0;     ///< unstable pole of the sliding plant, cart and motor included
  /// Feedback of angle and rate, with the acceleration of the pivot as input: sqrt(2) / rate (Stepan
  /// 1989; Insperger and Stepan, Stick balancing, 2021).
  double proportional_derivative_s = 0.0;
  /// With feedback of the angular acceleration as well: sqrt(2) times as much (Insperger, Milton, Stepan,
  /// J. R. Soc. Interface 10, 2013).
  double with_acceleration_s = 0.0;
  /// Any linear time-invariant controller that stabilises the plant for all delays up to this one: 2 /
  /// pole (Middleton and Miller, IEEE Trans. Automatic Control 52, 2007). A predictor for one delay may
  /// stabilise the plant for a longer delay, but not without delay.
  double linear_controller_s = 0.0;
};

/// Throws ConfigError for a plant without a pendulum.
PhysicalLimits physical_limits(const Plant& plant);

}  // namespace upright
