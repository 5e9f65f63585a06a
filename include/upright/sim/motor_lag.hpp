// The motor's first-order lag over one step under a held drive, solved exactly, for any scalar: double, dual
// numbers, lanes.
#pragma once

#include "upright/model/elementary.hpp"

namespace upright {

/// Voltage at the motor at the nodes of a Runge-Kutta step (beginning, middle, end) and after the step.
template <class T>
struct LaggedMotor {
  T begin_v;   ///< that the step uses at its beginning
  T middle_v;  ///< in its middle
  T end_v;     ///< and at its end
  T after_v;   ///< after the step
};

/// A step shorter than this part of the time constant resolves the exponential by its nodes.
constexpr double smooth_within_lags = 0.1;

/// Over a step of `r` time constants, fewer than `smooth_within_lags`.
template <class T>
LaggedMotor<T> slowly_lagged_motor(const T& motor_v, const T& drive, const T& r) {
  const T gap = motor_v - drive;
  const T half = elementary::exp(T(T(-0.5) * r));
  return {motor_v, drive + gap * half, drive + gap * half * half, drive + gap * half * half};
}

/// Over a step of any more. The nodes are of the parabola with the same zeroth, first and second moment as
/// exp(-r u), u in [0, 1]: the step then has the exact impulse, however short the lag.
template <class T>
LaggedMotor<T> quickly_lagged_motor(const T& motor_v, const T& drive, const T& r) {
  const T gap = motor_v - drive;
  const T e = elementary::exp(T(-r));
  const T m0 = (T(1.0) - e) / r;
  const T m1 = (m0 - e) / r;
  const T m2 = (T(2.0) * m1 - e) / r;
  return {drive + gap * (T(9.0) * m0 - T(36.0) * m1 + T(30.0) * m2),
          drive + gap * (T(-1.5) * m0 + T(15.0) * m1 - T(15.0) * m2),
          drive + gap * (T(3.0) * m0 - T(24.0) * m1 + T(30.0) * m2), drive + gap * e};
}

}  // namespace upright
