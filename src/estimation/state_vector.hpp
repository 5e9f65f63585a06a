// The estimated state of a plant as an array, in the order of LinearStep.
#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include "linear_step.hpp"
#include "upright/model/dynamics.hpp"

namespace upright {

constexpr int state_count = LinearStep::states;
constexpr int bristle_state = 4;  ///< its number

/// Pointers to the numbers of a state, constant or not.
template <class State>
auto as_array(State& s) -> std::array<decltype(&s.cart_m), state_count> {
  return {&s.cart_m, &s.theta_rad, &s.cart_mps, &s.theta_radps, &s.bristle_m, &s.attached_m, &s.attached_mps};
}

/// By how much bristles can be bent [m]: no further than friction holds them (the LuGre model, IEEE Trans.
/// Autom. Control 40 (1995) 419, property 1). A state beyond it snaps back in no time, which no step length
/// follows.
inline double longest_bend_m(const Dynamics<double>& dynamics, const PlantState<double>& state) {
  if (dynamics.depends_on_load() || dynamics.changes_with_time())
    return std::numeric_limits<double>::infinity();
  const double level_n = std::max(dynamics.cart_dry_level(state.cart_m, 0.0, 1.0),
                                  dynamics.cart_dry_level(state.cart_m, 0.0, -1.0));
  return level_n / dynamics.bristle_stiffness();
}

/// The number of states that the filter of a plant estimates: the first of them.
inline int estimated_states(const Plant& plant) {
  const bool attached = std::any_of(plant.effects.begin(), plant.effects.end(),
                                    [](const PlantEffect& e) { return attaches_mass(e.number); });
  return attached ? state_count : LinearStep::rigid_states;
}

}  // namespace upright
