// Phases are reported within (-pi, pi].
#pragma once

#include <cmath>
#include <numbers>

#include "upright/model/plant.hpp"

namespace upright {

inline bool is_phase(const ParameterInfo& parameter) {
  return parameter.name == "phase_rad";
}

inline double wrapped_phase(double phase_rad) {
  const double wrapped = std::remainder(phase_rad, 2.0 * std::numbers::pi);
  return wrapped == -std::numbers::pi ? std::numbers::pi : wrapped;
}

/// Every phase of the effects of a plant within (-pi, pi].
inline void wrap_phases(Plant& plant) {
  for (PlantEffect& effect : plant.effects) {
    const EffectInfo& info = effect_registry()[effect.number];
    for (std::size_t i = 0; i < info.parameters.size(); ++i)
      if (is_phase(info.parameters[i])) effect.values[i] = wrapped_phase(effect.values[i]);
  }
}

}  // namespace upright
