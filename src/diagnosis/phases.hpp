// Phases are reported within (-pi, pi]. An effect repeats along the track where its pitch is known.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <vector>

#include "upright/diagnosis/diagnosis.hpp"
#include "upright/model/plant.hpp"

namespace upright {

inline bool is_phase(std::string_view parameter) {
  return parameter == "phase_rad";
}

inline double wrapped_phase(double phase_rad) {
  const double wrapped = std::remainder(phase_rad, 2.0 * std::numbers::pi);
  return wrapped == -std::numbers::pi ? std::numbers::pi : wrapped;
}

/// Whether the interval of a phase is as long as half a turn, so that the sign of the force is not known. The
/// phase is that at the zero of the cart, so data far from it leave it open, and with it the force everywhere
/// but where they were measured.
inline bool is_phase_open(const std::vector<ParameterEstimate>& parameters) {
  return std::any_of(parameters.begin(), parameters.end(), [](const ParameterEstimate& p) {
    return is_phase(p.name) && p.high - p.low >= std::numbers::pi;
  });
}

/// Whether the interval of a pitch reaches the longest one that the data can show: then they do not show that
/// the effect repeats.
inline bool is_pitch_open(const std::vector<ParameterEstimate>& parameters, double longest_m) {
  return std::any_of(parameters.begin(), parameters.end(), [&](const ParameterEstimate& p) {
    return p.name == "pitch_m" && !(p.high < longest_m);
  });
}

/// Every phase of the effects of a plant within (-pi, pi].
inline void wrap_phases(Plant& plant) {
  for (PlantEffect& effect : plant.effects) {
    const EffectInfo& info = effect_registry()[effect.number];
    for (std::size_t i = 0; i < info.parameters.size(); ++i)
      if (is_phase(info.parameters[i].name)) effect.values[i] = wrapped_phase(effect.values[i]);
  }
}

}  // namespace upright
