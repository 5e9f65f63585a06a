// The limiter between the computed voltage and the amplifier.
#pragma once

#include <algorithm>
#include <cmath>

namespace upright {

/// A voltage after the limiter.
struct LimitedVoltage {
  double voltage_v = 0.0;  ///< within the limit; zero where the request was not finite [V]
  bool saturated = false;  ///< the limiter changed it
  bool finite = true;      ///< false: the request was not finite, the voltage is zero
};

/// The voltage within +-`limit_v` [V].
inline LimitedVoltage limit_voltage(double requested_v, double limit_v) noexcept {
  if (!std::isfinite(requested_v)) return {0.0, false, false};
  const double voltage = std::clamp(requested_v, -limit_v, limit_v);
  return {voltage, voltage != requested_v, true};
}

}  // namespace upright
