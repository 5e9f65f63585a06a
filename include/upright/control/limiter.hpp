// The limiter between the computed voltage and the amplifier.
#pragma once

#include <algorithm>
#include <cmath>

namespace upright {

struct LimitedVoltage {
  double voltage_v = 0.0;
  bool saturated = false;
  bool finite = true;  ///< false: the request was not finite, the voltage is zero
};

inline LimitedVoltage limit_voltage(double requested_v, double limit_v) noexcept {
  if (!std::isfinite(requested_v)) return {0.0, false, false};
  const double voltage = std::clamp(requested_v, -limit_v, limit_v);
  return {voltage, voltage != requested_v, true};
}

}  // namespace upright
