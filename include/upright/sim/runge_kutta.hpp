// The classical Runge-Kutta method of order 4 over a plant's state, for any scalar: double, dual numbers,
// lanes.
#pragma once

#include "upright/model/dynamics.hpp"

namespace upright {

/// Whether the voltage at the motor is a state that moves, or held over the step.
enum class MotorVoltage : std::uint8_t { held, moves };

template <MotorVoltage motor = MotorVoltage::held, class S>
PlantState<S> moved(const PlantState<S>& s, const PlantState<S>& rate, const S& h) {
  PlantState<S> to{s.cart_m + h * rate.cart_m,
                   s.theta_rad + h * rate.theta_rad,
                   s.cart_mps + h * rate.cart_mps,
                   s.theta_radps + h * rate.theta_radps,
                   s.motor_v,
                   s.bristle_m + h * rate.bristle_m};
  if constexpr (motor == MotorVoltage::moves) to.motor_v = s.motor_v + h * rate.motor_v;
  return to;
}

/// Where in a step a rate is asked for. Its beginning is asked for by the caller.
enum class Stage : std::uint8_t { middle, end };

/// One step of length h from `s`. `first` is the rate at its beginning, `rate(state, Stage)` that of the
/// others.
template <MotorVoltage motor = MotorVoltage::held, class S, class Rate>
PlantState<S> runge_kutta_4(const Rate& rate, const PlantState<S>& s, const PlantState<S>& first,
                            const S& h) {
  const S half = S(0.5) * h;
  const PlantState<S> second = rate(moved<motor>(s, first, half), Stage::middle);
  const PlantState<S> third = rate(moved<motor>(s, second, half), Stage::middle);
  const PlantState<S> fourth = rate(moved<motor>(s, third, h), Stage::end);
  const S sixth = h / S(6.0);
  const auto along = [&](S PlantState<S>::*of) {
    return s.*of + sixth * (first.*of + S(2.0) * (second.*of + third.*of) + fourth.*of);
  };
  PlantState<S> end;
  end.cart_m = along(&PlantState<S>::cart_m);
  end.theta_rad = along(&PlantState<S>::theta_rad);
  end.cart_mps = along(&PlantState<S>::cart_mps);
  end.theta_radps = along(&PlantState<S>::theta_radps);
  end.motor_v = s.motor_v;
  if constexpr (motor == MotorVoltage::moves) end.motor_v = along(&PlantState<S>::motor_v);
  end.bristle_m = along(&PlantState<S>::bristle_m);
  return end;
}

}  // namespace upright
