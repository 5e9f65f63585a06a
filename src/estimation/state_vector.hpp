// The estimated state of a plant as an array, in the order of LinearStep.
#pragma once

#include <algorithm>
#include <array>

#include "linear_step.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

constexpr int state_count = LinearStep::states;
constexpr int bristle_state = LinearStep::rigid_states - 1;  ///< its number
constexpr int attached_state = LinearStep::rigid_states;     ///< of an attached mass; then its speed

/// Pointers to the numbers of a state, constant or not.
template <class State>
auto as_array(State& s) -> std::array<decltype(&s.cart_m), state_count> {
  return {&s.cart_m, &s.theta_rad, &s.cart_mps, &s.theta_radps, &s.bristle_m, &s.attached_m, &s.attached_mps};
}

/// The number of states that the filter of a plant estimates: the first of them.
inline int estimated_states(const Plant& plant) {
  const bool attached = std::any_of(plant.effects.begin(), plant.effects.end(),
                                    [](const PlantEffect& e) { return attaches_mass(e.number); });
  return attached ? state_count : LinearStep::rigid_states;
}

}  // namespace upright
