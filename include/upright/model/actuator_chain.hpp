// What the effects make of a commanded voltage on its way to the motor.
#pragma once

#include "upright/model/plant_model.hpp"

namespace upright {

/// Voltage after dead zone, gain, offset and saturation; engines treat delay and lag. `Present` as in
/// Dynamics.
template <class S, class Present>
S actuated(const PlantModel<S>& model, const Present& present, S volts) {
  for (int stage = 1; stage <= 4; ++stage)
    for_each_effect([&]<std::size_t I>() {
      using E = EffectAt<I>;
      if constexpr (requires { E::actuator_stage; })
        if (E::actuator_stage == stage && present.template has<I>())
          volts = E::actuate(model.template of<I>(), volts);
    });
  return volts;
}

/// Delay of the plant's input [s].
template <class S, class Present>
S input_delay_of(const PlantModel<S>& model, const Present& present) {
  S delay(0.0);
  for_each_effect([&]<std::size_t I>() {
    using E = EffectAt<I>;
    if constexpr (requires { E::input_delay_s(model.template of<I>()); })
      if (present.template has<I>()) delay = delay + E::input_delay_s(model.template of<I>());
  });
  return delay;
}

/// Of the motor lag [s]; 0: none.
template <class S, class Present>
S motor_time_constant_of(const PlantModel<S>& model, const Present& present) {
  S constant(0.0);
  for_each_effect([&]<std::size_t I>() {
    using E = EffectAt<I>;
    if constexpr (requires { E::motor_time_constant_s(model.template of<I>()); })
      if (present.template has<I>()) constant = E::motor_time_constant_s(model.template of<I>());
  });
  return constant;
}

}  // namespace upright
