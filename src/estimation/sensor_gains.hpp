// The gains of the sensors. Their values are linear in the state.
#pragma once

#include <array>

#include "upright/model/dynamics.hpp"

namespace upright {

/// The sensor value for a unit of cart position or pendulum angle.
template <class S>
std::array<S, 2> sensor_gains(const Dynamics<S>& dynamics) {
  PlantState<S> unit;
  unit.cart_m = unit.theta_rad = S(1.0);
  const Outputs<S> at_0 = dynamics.measure(PlantState<S>{}), at_1 = dynamics.measure(unit);
  return {at_1.cart_m - at_0.cart_m, at_1.theta_rad - at_0.theta_rad};
}

}  // namespace upright
